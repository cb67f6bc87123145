from dataclasses import dataclass, replace

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.screening import COARSE_STEP, FINE_STEP, refine_best, thinned
from mvreg.stages.judge.residual import ResidualJudge
from mvreg.stages.refine.trimmed import TrimmedICP
from mvreg.stages.strategy.grow import GrowStrategy
from mvreg.testing import overlap, pipeline
from mvreg.testing.refine import nudge
from mvreg.types import Candidates, Verdict, ViewGraph


def candidates(pair, *starts):
    poses = [pair.T_target_source @ nudge(pair.source, *start) for start in starts]
    return Candidates(np.array(poses), np.arange(len(poses)), (np.empty((0, 2), int),) * len(poses))


@dataclass(frozen=True)
class Counting(TrimmedICP):
    def __call__(self, source, target, transform):
        COUNTED.append(len(source.points))
        return super().__call__(source, target, transform)


COUNTED = []


@pytest.fixture(autouse=True)
def begin():
    COUNTED.clear()


def test_the_best_candidate_wins_wherever_it_stands_in_the_list():
    pair = overlap()
    found = refine_best(
        TrimmedICP(), pair.source, pair.target, candidates(pair, (170, 40), (150, 9), (2, 1))
    )
    assert se3.rotation_angle(found.T_target_source, pair.T_target_source) < np.deg2rad(2)
    assert len(found.alternatives) == 2
    assert refine_best(TrimmedICP(), pair.source, pair.target, Candidates.none()) is None


def test_all_points_are_asked_of_one_candidate_only():
    pair = overlap()
    refine_best(Counting(), pair.source, pair.target, candidates(pair, (170, 40), (150, 9), (2, 1)))
    size = len(pair.source.points)
    subsampled, more = -(-size // COARSE_STEP), -(-size // FINE_STEP)
    assert COUNTED[:3] == [subsampled] * 3 and COUNTED[-1] == size
    assert set(COUNTED[3:-1]) == {more}


def test_what_is_hopeless_on_few_points_is_not_refined_on_all():
    pair = overlap()
    shown = []
    found = refine_best(
        Counting(), pair.source, pair.target, candidates(pair, (2, 1)),
        lambda registration, subsampled: bool(shown.append((registration, subsampled)) or True),
    )  # fmt: skip
    (asked, subsampled), size = shown[0], len(pair.source.points)
    assert size not in COUNTED
    np.testing.assert_array_equal(subsampled.points, thinned(pair.source, FINE_STEP).points)
    np.testing.assert_array_equal(asked.pairs * [FINE_STEP, 1], found.pairs)
    moved = se3.apply(found.T_target_source, pair.source.points[found.pairs[:, 0]])
    gaps = np.linalg.norm(moved - pair.target.points[found.pairs[:, 1]], axis=1)
    np.testing.assert_allclose(gaps, found.distances, atol=1e-9)


@pytest.mark.parametrize(("score", "whole"), [(2.9, True), (3.1, False), (0.5, True)])
def test_the_judge_says_what_is_hopeless(score, whole):
    @dataclass(frozen=True)
    class Says(ResidualJudge):
        def __call__(self, registration, source, target, graph):
            return Verdict(score < 1, score, 1.0, "as told")

    pair = overlap()
    pipe = replace(pipeline(), refine=Counting(), judge=Says())
    pipe.register(
        pair.source, pair.target, ViewGraph(), np.random.default_rng(0), early_rejection=3.0
    )
    assert (len(pair.source.points) in COUNTED) == whole
    COUNTED.clear()
    pipe.register(pair.source, pair.target, ViewGraph(), np.random.default_rng(0))
    assert len(pair.source.points) in COUNTED


def test_the_factor_of_early_rejection_is_positive():
    with pytest.raises(InputError, match=r"strategy\.early_rejection"):
        GrowStrategy(early_rejection=0.0)
