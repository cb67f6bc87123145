"""Thin things: what looks the same from behind as turned over is not laid on its other side."""

import numpy as np
import pytest

import mvreg
from experiments.accuracy.placements import Tolerance, Truth
from experiments.accuracy.sides import Scissors, counted
from mvreg.datasets.base import Order


@pytest.mark.parametrize("variant", [0, 3])
def test_no_back_of_scissors_ends_on_their_front(variant):
    source = Scissors(
        thickness=3.0, variant=variant, order=Order.shuffle, scramble=True, sensor="unknown"
    )
    scans = source(np.random.default_rng(variant))
    result = mvreg.register(scans, rng=variant)
    truth = Truth(scans.as_read(scans.poses), dict.fromkeys(scans.poses, ""))
    right, false = counted(result, truth, scans, Tolerance(2.0, 2.0))
    assert false == 0
    assert right >= 8
