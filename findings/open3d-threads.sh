#!/usr/bin/env bash
# Open3D 0.20.0 takes every core, whatever OMP_NUM_THREADS says.
#
# Expected: OMP_NUM_THREADS=1 is how jobs that run side by side on one machine are kept to a core
#   each; NumPy's BLAS goes by it, and so did Open3D while it was parallel by OpenMP.
# Seen: estimating the normals of 60,000 points starts a thread for every further core. Open3D is
#   built on oneTBB now, which does not read the variable, and its Python interface has no setting
#   for the number of threads.
# Why it matters: registrations that are timed "on one thread" are not, and a sweep with a job per
#   core runs as many threads as cores squared.
#
# Needs Linux and two cores. Fails if Open3D comes to go by the variable.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
# libusb-package: Open3D's wheels are linked against libusb, which a bare Debian lacks.
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
  open3d-cpu==0.20.0 numpy==2.4.6 libusb-package==1.0.30.0

OMP_NUM_THREADS=1 "$folder/venv/bin/python" - <<'PYTHON'
import ctypes
import os
import sys

import libusb_package
import numpy as np

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
import open3d

assert (os.cpu_count() or 1) > 1, "with one core there is nothing to see"
points = np.random.default_rng(0).random((60_000, 3))
cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
before = len(os.listdir("/proc/self/task"))
cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(20))
after = len(os.listdir("/proc/self/task"))
print(f"Open3D {open3d.__version__}, OMP_NUM_THREADS=1, {os.cpu_count()} cores: "
      f"{before} thread(s) before, {after} after estimating normals")
sys.exit(0 if after > before else "as expected now: no thread was started")
PYTHON
# Open3D 0.20.0, OMP_NUM_THREADS=1, 2 cores: 1 thread(s) before, 2 after estimating normals
