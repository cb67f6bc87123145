#!/usr/bin/env bash
# small_gicp 1.0.1 thins scans in map coordinates to one point each, and says that it converged.
#
# Expected: two overlapping clouds 1,000,000 m from the origin, as in national grids, are registered
#   as they are at the origin, or refused.
# Seen: align thins with cells counted from the origin in 21 bits; beyond 2^20 cells (524 km at 0.5 m)
#   all points fall into one cell and one of them is left. A line on stderr for each point says that a
#   cell is out of range; the result says converged, with no inlier and an error of 0, and leaves
#   the scans where they were.
# Why it matters: `converged` is what programs test, and the error what they compare; here both are
#   those of a perfect registration. Subtract an offset first.
#
# Fails if small_gicp comes to register or to refuse them.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check small_gicp==1.0.1 numpy==2.4.6

"$folder/venv/bin/python" - 2>"$folder/stderr" <<'PYTHON' || { tail -n 5 "$folder/stderr"; exit 1; }
import sys

import numpy as np
import small_gicp

def surface(rng):
    x, y = rng.random((2, 5000)) * 20.0
    return np.column_stack([x, y, np.sin(x / 3) + np.cos(y / 2)])


rng = np.random.default_rng(0)
target, source = surface(rng), surface(rng)
results = []
for offset in (0.0, 1e6):
    origin = np.array([offset, offset, 0.0])
    shift = np.array([0.4, 0.2, 0.1])
    result = small_gicp.align(target + origin, source + shift + origin, downsampling_resolution=0.5)
    T = result.T_target_source
    moved = (source + shift + origin) @ T[:3, :3].T + T[:3, 3]
    off = np.linalg.norm(moved - source - origin, axis=1).mean()
    results.append(result)
    print(
        f"at {offset:.0f} m: converged {result.converged}, inliers {result.num_inliers}, "
        f"error {result.error:.2g}, {off:.2f} m off ({np.linalg.norm(shift):.2f} before)"
    )
near, far = results
assert near.converged and near.num_inliers > 1000
good = far.converged and far.num_inliers < 2 and far.error < 1e-9
sys.exit(0 if good else "as expected now: they were registered or refused")
PYTHON
echo "stderr, lines by kind:"; sort "$folder/stderr" | uniq -c
# at 0 m: converged True, inliers 1863, error 31, 0.00 m off (0.46 before)
# at 1000000 m: converged True, inliers 0, error 0, 0.46 m off (0.46 before)
