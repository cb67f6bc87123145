import numpy as np
from mutual import MutualSeed

import mvreg
from mvreg.testing import SeedContract


class TestMutualSeed(SeedContract):
    stage = MutualSeed()


def test_no_keypoint_is_matched_twice():
    source, target = mvreg.prepare(mvreg.dataset("tiny"))[:2]
    matches = MutualSeed()(source, target).indices
    assert 0 < len(matches) <= 100
    for side in matches.T:
        assert len(np.unique(side)) == len(side)
