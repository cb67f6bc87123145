#!/usr/bin/env bash
# pye57 0.4.19 writes colours modulo 256 and row indices modulo 65,536, without a word.
#
# Expected: write_scan_raw writes the integers that it is given, as the format can, or refuses them.
# Seen: a colour of 300 comes back as 44, and row 70,000 as row 4,464. Files of other programs that
#   have such values are refused by read_scan, as not representable.
# Why it matters: scanners have colours of 16 bits; copied by pye57 they are noise, and a scan of
#   more than 65,536 rows is folded onto itself.
#
# Fails if pye57 comes to write them or to refuse them.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pye57==0.4.19 numpy==2.4.6

"$folder/venv/bin/python" - "$folder/a.e57" <<'PYTHON'
import sys
from importlib.metadata import version

import numpy as np
import pye57

colours = np.array([0, 255, 256, 300, 65535])
rows = np.array([0, 1, 65535, 65536, 70000])
columns = {f"cartesian{axis}": np.arange(5.0) for axis in "XYZ"}
columns |= {f"color{name}": colours for name in ("Red", "Green", "Blue")}
columns |= {"rowIndex": rows, "columnIndex": np.arange(5)}
with pye57.E57(sys.argv[1], "w") as file:
    file.write_scan_raw(columns)
with pye57.E57(sys.argv[1]) as file:
    read = file.read_scan_raw(0)
red, row = read["colorRed"].tolist(), read["rowIndex"].tolist()
print(f"pye57 {version('pye57')}: wrote colours {colours.tolist()}, read {red}")
print(f"pye57 {version('pye57')}: wrote rows {rows.tolist()}, read {row}")
wrapped = red == (colours % 256).tolist() and row == (rows % 65536).tolist()
sys.exit(0 if wrapped else "as expected now")
PYTHON
# pye57 0.4.19: wrote colours [0, 255, 256, 300, 65535], read [0, 255, 0, 44, 255]
# pye57 0.4.19: wrote rows [0, 1, 65535, 65536, 70000], read [0, 1, 65535, 0, 4464]
