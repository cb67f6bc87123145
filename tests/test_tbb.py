"""Open3D uses as many threads as mvreg is told to use."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

#: Counts the threads of the process while Open3D works on enough points to want them all.
COUNT = """
import os
import numpy as np
import mvreg
open3d = mvreg.load_open3d()
mvreg.load_open3d()  # once more changes nothing
before = len(os.listdir("/proc/self/task"))
cloud = open3d.geometry.PointCloud(
    open3d.utility.Vector3dVector(np.random.default_rng(0).random((60_000, 3)))
)
cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(20))
moved = open3d.geometry.PointCloud(cloud).translate((0.001, 0, 0))
open3d.pipelines.registration.evaluate_registration(cloud, moved, 0.1)
from mvreg.tbb import copies_of_tbb, threads_allowed
allowed = [threads_allowed(path) for path in copies_of_tbb(open3d)]
print(before, len(os.listdir("/proc/self/task")), *allowed)
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="counts threads in Linux's /proc")
@pytest.mark.parametrize("wanted", [1, 3])
def test_open3d_goes_by_omp_num_threads(wanted):
    done = subprocess.run(
        [sys.executable, "-c", COUNT], env={**os.environ, "OMP_NUM_THREADS": str(wanted)},
        capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    before, after, *allowed = map(int, done.stdout.split())
    assert allowed and set(allowed) == {wanted}
    if wanted == 1:
        assert after == before, "Open3D has started threads"
