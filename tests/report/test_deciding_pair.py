"""Which attempt is told of a scan, and what is said of it."""

import math

import numpy as np

from mvreg.report.deciding_pair import closest, deciding_pair
from mvreg.types import Pair, Result, Verdict


def pair(source, target, reliable=True, score=1.0, threshold=2.0):
    return Pair(source, target, Verdict(reliable, score, threshold, ""), np.eye(4), 0.6, 0.01)


def test_the_pair_that_a_scan_came_in_with_counts_not_one_that_came_in_by_it():
    came, brought = pair("b", "a"), pair("c", "b")
    result = Result("a", {name: np.eye(4) for name in "abc"}, (), (came, brought))
    assert deciding_pair("b", result) is came
    assert deciding_pair("c", result) is brought


def test_the_closest_attempt_is_the_one_that_lacked_least():
    far, near = pair("a", "b", False, 9.0), pair("a", "c", False, 2.5)
    assert closest([far, near]) is closest([near, far]) is near
    assert closest([]) is None


def test_an_attempt_that_failed_is_told_before_one_that_was_accepted():
    accepted, failed = pair("a", "b", True, 0.1), pair("a", "c", False, 9.0)
    assert closest([accepted, failed]) is closest([failed, accepted]) is failed


def test_what_cannot_be_measured_is_never_the_closest():
    near = pair("a", "b", False, 2.5)
    for score, threshold in ((math.inf, math.inf), (1.0, 0.0), (math.inf, 2.0)):
        none = pair("a", "c", False, score, threshold)
        assert closest([none, near]) is closest([near, none]) is near
