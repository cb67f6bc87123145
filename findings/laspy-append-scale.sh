#!/usr/bin/env bash
# laspy 2.7.0 appends points of another scale as if they had the scale of the file.
#
# Expected: append_points takes a record of points that knows its own scale and offset; it converts
#   them to those of the file, or refuses them.
# Seen: the integers are copied. Points kept in centimetres and appended to a file kept in
#   millimetres come back at a tenth of their coordinates, and nothing is said.
# Why it matters: tiles of one survey come from several programs with a scale each, and appending is
#   how they are merged without holding all; the merged file has the right number of points.
#
# Fails if laspy comes to convert or to refuse them.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check laspy==2.7.0 numpy==2.4.6

"$folder/venv/bin/python" - "$folder/merged.las" <<'PYTHON'
import sys

import laspy
import numpy as np


def cloud(points, scale):
    header = laspy.LasHeader(point_format=3, version="1.4")
    header.scales, header.offsets = [scale] * 3, [0, 0, 0]
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    return las


points = np.array([[10.0, 20.0, 30.0], [11.0, 22.0, 33.0]])
cloud(points, 0.001).write(sys.argv[1])
with laspy.open(sys.argv[1], mode="a") as file:
    file.append_points(cloud(points, 0.01).points)
read = laspy.read(sys.argv[1]).xyz
print(f"laspy {laspy.__version__}: written {points.tolist()}, twice")
print(f"read: {read[:2].tolist()} and {read[2:].tolist()}")
assert (read[:2] == points).all()
sys.exit(0 if np.allclose(read[2:], points / 10) else "as expected now: they were converted")
PYTHON
# laspy 2.7.0: written [[10.0, 20.0, 30.0], [11.0, 22.0, 33.0]], twice
# read: [[10.0, 20.0, 30.0], [11.0, 22.0, 33.0]] and [[1.0, 2.0, 3.0], [1.1, 2.2, 3.3000000000000003]]
