"""SurfC and SpanT on real scans; skipped, loudly, where MVREG_DATA does not say where they are."""

import os
from pathlib import Path

import numpy as np
import pytest

import mvreg
from mvreg import pose_errors

#: e_R and e_t of Table 2, in file order.
PRINTED = {"surfc": (0.0262, 1.4734), "spant": (0.0242, 1.3588)}
WRONG = 5.0


@pytest.fixture(scope="module")
def root() -> Path:
    folder = os.environ.get("MVREG_DATA")
    if not folder or not Path(folder).is_dir():
        pytest.skip("needs real scans: set MVREG_DATA to the folder that holds them")
    return Path(folder)


@pytest.mark.slow
@pytest.mark.parametrize("method", sorted(PRINTED))
def test_bunny_is_no_worse_than_printed(root, method):
    scans = mvreg.dataset("bunny", root=str(root))
    result = mvreg.register(scans, method)
    errors = pose_errors(result.poses, scans.poses, result.reference)
    assert result.unregistered == ()
    assert errors.max.angle < WRONG
    assert errors.mean.rotation <= PRINTED[method][0]
    assert errors.mean.translation <= PRINTED[method][1]
    every = len(scans.scans) * (len(scans.scans) - 1) // 2
    assert len(result.pairs) == every if method == "surfc" else len(result.pairs) <= every
    assert np.isfinite(list(result.poses.values())).all()
