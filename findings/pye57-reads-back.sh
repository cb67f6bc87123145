#!/usr/bin/env bash
# pye57 0.4.19 cannot by default read back what it wrote.
#
# Expected: read_scan(0) reads a scan that write_scan_raw has written: x, y and z of three points.
# Seen: ValueError, "Requested to read a field (cartesianInvalidState) with is absent from the e57
#   file", although the standard has that field as optional.
# Why it matters: any file without invalid points is refused, until ignore_missing_fields is found.
#
# Fails if pye57 comes to read it.
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

with pye57.E57(sys.argv[1], "w") as file:
    file.write_scan_raw({f"cartesian{axis}": np.arange(3.0) for axis in "XYZ"})
try:
    with pye57.E57(sys.argv[1]) as file:
        file.read_scan(0)
except ValueError as error:
    print(f"pye57 {version('pye57')}: {error}")
else:
    sys.exit("as expected now: it was read")
PYTHON
# pye57 0.4.19: Requested to read a field (cartesianInvalidState) with is absent from the e57 file. Consider using 'ignore_missing_fields' to skip it.
