#!/usr/bin/env bash
# laspy 2.7.0 reads a LAS file that is cut off as one with fewer points.
#
# Expected: the header announces 1,000 points, and half of them are missing: an error.
# Seen: chunk_iterator gives 500 points and ends, and laspy.read gives 500 too; no exception, no
#   warning, but for a line that goes to a logger.
# Why it matters: a copy that was interrupted looks like a whole scan with a part missing.
#
# Fails if laspy comes to raise.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check laspy==2.7.0 numpy==2.4.6

"$folder/venv/bin/python" -W error - "$folder/a.las" <<'PYTHON'
import sys
from pathlib import Path

import laspy
import numpy as np

path = Path(sys.argv[1])
data = laspy.LasData(laspy.LasHeader(point_format=0, version="1.2"))
data.x = data.y = data.z = np.arange(1000.0)
data.write(path)
whole = path.read_bytes()
path.write_bytes(whole[: len(whole) - 500 * 20])
with laspy.open(path) as file:
    announced = file.header.point_count
    chunks = sum(len(chunk) for chunk in file.chunk_iterator(300))
try:
    read = len(laspy.read(path).x)
except Exception as error:
    read = f"{type(error).__name__}: {error}"
print(f"laspy {laspy.__version__}: {announced} points announced, chunk_iterator gives {chunks}, "
      f"read gives {read}")
sys.exit(0 if chunks < announced else "as expected now")
PYTHON
# laspy 2.7.0: 1000 points announced, chunk_iterator gives 500, read gives 500
