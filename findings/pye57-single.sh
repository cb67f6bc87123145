#!/usr/bin/env bash
# pye57 0.4.19 writes coordinates in single precision, whatever it is given, and says nothing.
#
# Expected: E57 has doubles; write_scan_raw is given doubles, and read_scan returns doubles.
# Seen: at 5,000,000, as in national grids in metres, coordinates come back up to a quarter of a
#   metre off: write_scan_raw asks for E57_SINGLE, and has no parameter for another.
# Why it matters: scans in a projected coordinate system are ruined on the way out, by more than
#   any registration error. libE57 below it, pye57.libe57, writes doubles if asked.
#
# Fails if pye57 comes to write doubles.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pye57==0.4.19 numpy==2.4.6

"$folder/venv/bin/python" - "$folder/cloud.e57" <<'PYTHON'
import sys
from importlib.metadata import version

import numpy as np
import pye57

x = 5_000_000 + np.array([0.0, 0.1, 0.2, 0.3])
file = pye57.E57(sys.argv[1], mode="w")
file.write_scan_raw({"cartesianX": x, "cartesianY": x, "cartesianZ": x})
file.close()
read = pye57.E57(sys.argv[1]).read_scan_raw(0)["cartesianX"]
print(f"pye57 {version('pye57')}: written {x.tolist()}")
print(f"read {read.dtype} {read.tolist()}: off by up to {np.abs(read - x).max():.2f}")
sys.exit(0 if np.abs(read - x).max() > 0.05 else "as expected now: doubles came back")
PYTHON
# pye57 0.4.19: written [5000000.0, 5000000.1, 5000000.2, 5000000.3]
# read float64 [5000000.0, 5000000.0, 5000000.0, 5000000.5]: off by up to 0.20
