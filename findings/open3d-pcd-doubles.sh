#!/usr/bin/env bash
# Open3D 0.20.0 reads every coordinate of a PCD file with doubles as 0, and says nothing.
#
# Expected: the PCD format has coordinates of 8 bytes (SIZE 8, TYPE F); Open3D's own tensor reader,
#   open3d.t.io.read_point_cloud, reads them.
# Seen: open3d.io.read_point_cloud returns as many points as there are, all at 0, 0, 0.
# Why it matters: doubles are what coordinates far from the origin need; a model exported so is
#   there, has the right number of points, and no shape.
#
# Needs Linux on x86-64. Fails if Open3D comes to read them.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
# libusb-package: Open3D's wheels are linked against libusb, which a bare Debian lacks.
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
  open3d-cpu==0.20.0 numpy==2.4.6 libusb-package==1.0.30.0

"$folder/venv/bin/python" - "$folder/cloud.pcd" <<'PYTHON'
import ctypes
import sys

import libusb_package
import numpy as np

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
import open3d

points = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
header = (
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\n"
    "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA binary\n"
)
with open(sys.argv[1], "wb") as file:
    file.write(header.encode() + points.tobytes())
legacy = np.asarray(open3d.io.read_point_cloud(sys.argv[1]).points)
tensor = open3d.t.io.read_point_cloud(sys.argv[1]).point.positions.numpy()
print(f"Open3D {open3d.__version__}: written {points.tolist()}")
print(f"open3d.io: {legacy.tolist()}, open3d.t.io: {tensor.tolist()}")
assert (tensor == points).all()
sys.exit(0 if legacy.shape == (2, 3) and not legacy.any() else "as expected now: they were read")
PYTHON
# Open3D 0.20.0: written [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
# open3d.io: [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], open3d.t.io: [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
