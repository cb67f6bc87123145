#!/usr/bin/env bash
# Open3D 0.20.0 reads the first scan of a PTS file that holds several, and does not name the rest.
#
# Expected: PTS is a count, then as many lines; exports of several stations repeat that in one file.
#   A reader gives all points, or says that lines were left.
# Seen: read_point_cloud returns the points of the first count. Its one warning, that only points and
#   colours are read, is printed for files with one scan, too.
# Why it matters: a project of ten stations becomes its first, a success.
#
# Needs Linux on x86-64. Fails if Open3D comes to read them or to say what was left.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
# libusb-package: Open3D's wheels are linked against libusb, which a bare Debian lacks.
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
  open3d-cpu==0.20.0 numpy==2.4.6 libusb-package==1.0.30.0

"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import ctypes
import sys

import libusb_package
import numpy as np

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
import open3d

line = "{:.3f} {:.3f} {:.3f} -500 10 20 30\n"


def station(points):
    return f"{len(points)}\n" + "".join(line.format(*point) for point in points)


first, second = np.arange(30.0).reshape(10, 3), np.arange(60.0).reshape(20, 3) / 7
read = {}
for name, stations in {"one": [first], "two": [first, second]}.items():
    with open(f"{sys.argv[1]}/{name}.pts", "w") as file:
        file.writelines(map(station, stations))
    read[name] = len(open3d.io.read_point_cloud(f"{sys.argv[1]}/{name}.pts").points)
print(f"Open3D {open3d.__version__}: points read of 10: {read['one']}; of 10 and 20: {read['two']}")
assert read["one"] == 10
sys.exit(0 if read["two"] == 10 else "as expected now: they were read")
PYTHON
# Open3D 0.20.0: points read of 10: 10; of 10 and 20: 10
