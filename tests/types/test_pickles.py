"""What goes in and out of mvreg can be copied and pickled, as job queues and caches do."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

import mvreg


@pytest.fixture(scope="module")
def registered():
    scans = mvreg.dataset("tiny")
    return scans, mvreg.register(scans)


@pytest.mark.parametrize(
    "copied", [lambda it: pickle.loads(pickle.dumps(it)), copy.deepcopy], ids=["pickle", "deepcopy"]
)
def test_that_scans_and_results_can_be_copied(registered, copied):
    scans, result = registered
    assert "tree" in vars(scans.scans[0])  # what was worked out is left behind
    again, found = copied(scans), copied(result)
    assert set(vars(again.scans[0])) == set(scans.scans[0].__dataclass_fields__)
    for name, pose in result.poses.items():
        np.testing.assert_array_equal(found.poses[name], pose)
    one, other = list(result.poses)[1:3]
    np.testing.assert_array_equal(
        mvreg.relative_covariance(found, one, other), mvreg.relative_covariance(result, one, other)
    )
    for new, old in zip(found.views, result.views, strict=True):
        np.testing.assert_array_equal(new.tree.nearest(old.points)[0], 0.0)
    poses = mvreg.register(again).poses
    for name, pose in result.poses.items():
        np.testing.assert_array_equal(poses[name], pose)
