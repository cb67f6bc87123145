from dataclasses import replace

import pytest
from mvreg_comparators import mvreg_suites
from mvreg_comparators.dual import DualJudge

from mvreg.stages import TrimmedICP
from mvreg.testing import overlap
from mvreg.testing.views import graph_of
from mvreg.types import Model


class TestDualJudge(mvreg_suites()["judge/dual"]):
    """The contract, with a tolerance for coarse scans."""


@pytest.fixture(scope="module")
def found():
    pair = overlap()
    return TrimmedICP()(pair.source, pair.target, pair.T_target_source)


def reason(found, accepted=(), **changes):
    pair = overlap()
    verdict = replace(DualJudge(max_rotation=5.0), **changes)(
        found, pair.source, pair.target, graph_of(*accepted)
    )
    assert not verdict.reliable
    return verdict.reason


def test_each_reason_to_refuse(found):
    assert reason(found, first_factor=0.01) == "trimmed MSE too large"
    assert reason(found, min_overlap=0.99) == "overlap below 0.99"
    assert reason(found, max_rotation=1e-3) == "the way back does not undo it"
    assert reason(found, motion_factor=1e-3) == "the way back does not undo it"
    assert reason(found, either_factor=1e-3) == "the way back does not undo it"


def test_what_is_accepted_sets_the_level(found):
    better = replace(found, trimmed_mse=found.trimmed_mse / 3)
    assert reason(found, [better, better]) == "trimmed MSE too large"


def test_the_way_back_from_a_merged_model(found):
    pair = overlap()
    model = Model.of(pair.target)
    assert DualJudge(max_rotation=5.0)(found, pair.source, model, ()).reliable
