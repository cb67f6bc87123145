from dataclasses import replace

import numpy as np
import pytest
from mvreg_comparators import mvreg_suites
from mvreg_comparators.dual import DualCriterion, disagreement
from mvreg_comparators.spant import SpanningTreeStrategy
from trees import Trusting, blobs, knowing, off, truth, turned

import mvreg
from mvreg import events
from mvreg.geometry import se3
from mvreg.testing import overlap
from mvreg.testing.views import registration
from mvreg.types import Verdict

SPANT = SpanningTreeStrategy()


class TestSpanningTreeStrategy(mvreg_suites()["strategy/spant"]):
    """The contract, with a tolerance for coarse scans."""


def run(views, pipe, strategy=SPANT):
    return strategy(views, pipe, np.random.default_rng(0))


def names(result):
    return [(pair.source[-1], pair.target[-1]) for pair in result.pairs]


def test_each_pair_is_registered_there_and_back():
    result = run(blobs(3), knowing(3))
    assert names(result) == [("1", "0"), ("0", "1"), ("2", "0"), ("0", "2")]
    assert result.unregistered == ()
    assert off(result, 3) < 0.1


def test_it_grows_breadth_first():
    """What the reference refuses is tried at the others in the order in which they were taken."""
    cut = {("blob_2", "blob_0"): None, ("blob_4", "blob_0"): None, ("blob_2", "blob_1"): None,
           ("blob_4", "blob_1"): None}  # fmt: skip
    told = []
    result = run(blobs(5), knowing(5, cut).observed_by(told.append))
    assert [e.name[-1] for e in told if type(e) is events.ViewPlaced] == ["1", "3", "2", "4"]
    assert ("2", "3") in names(result)
    assert ("2", "4") not in names(result)
    assert off(result, 5) < 0.1
    assert isinstance(told[0], events.ReferenceChosen)


def test_a_pair_that_disagrees_with_its_way_back_is_refused():
    astray = {("blob_0", "blob_1"): turned(3, "blob_0", "blob_1")}
    result = run(blobs(3), knowing(3, astray))
    assert names(result)[:2] == [("1", "0"), ("0", "1")]
    assert result.unregistered == ()
    assert ("1", "2") in names(result)  # by way of the other
    assert off(result, 3) < 0.1


def test_a_bad_fit_has_no_way_back():
    astray = {("blob_1", "blob_0"): turned(2, "blob_1", "blob_0")}
    result = run(blobs(2), knowing(2, astray))
    assert names(result) == [("1", "0")]
    assert result.unregistered == ("blob_1",)


def test_no_way_back_is_a_refusal():
    result = run(blobs(2), knowing(2, {("blob_0", "blob_1"): None}))
    assert names(result) == [("1", "0"), ("0", "1")]
    assert result.unregistered == ("blob_1",)
    assert list(result.poses) == ["blob_0"]


class Doubting:
    def __call__(self, registration, source, target, graph):
        return Verdict(source.name != "blob_0", 0.0, 1.0, "doubts what moves the first")


def test_the_composed_judge_has_a_say_if_asked():
    pipe = replace(knowing(2), judge=Doubting())
    assert run(blobs(2), pipe).unregistered == ()
    assert run(blobs(2), pipe, replace(SPANT, judged=True)).unregistered == ("blob_1",)
    trusting = replace(pipe, judge=Trusting())
    assert run(blobs(2), trusting, replace(SPANT, judged=True)).unregistered == ()


def pair_with(mse_there, mse_back, shift=0.0, degrees=0.0):
    """Two registrations with the given TMSEs, the way back off by a shift and a turn."""
    pair = overlap()
    there = registration(pair.source, pair.target, pair.T_target_source)
    centre, half = pair.source.points.mean(axis=0), np.deg2rad(degrees) / 2
    turn = se3.rotation_from_quaternion(np.array([0, np.sin(half), 0, np.cos(half)]))
    motion = se3.from_parts(turn, centre - turn @ centre + [shift, 0, 0])
    pose = se3.invert(pair.T_target_source @ motion)
    back = replace(registration(pair.target, pair.source, pose), trimmed_mse=mse_back)
    return replace(there, trimmed_mse=mse_there), back, pair.source


def test_the_three_criteria():
    criterion, source = DualCriterion(), overlap().source
    unit = source.scale.resolution / 1.4
    level = 1.5 * unit

    def agree(there=1.0, back=1.0, **changes):
        first, second, view = pair_with(there * unit**2, back * unit**2, **changes)
        return criterion.agree(first, second, view, level)

    assert criterion.fits(pair_with(4.19 * unit**2, 0)[0], source, level)  # 2.8 * 1.5 = 4.2
    assert not criterion.fits(pair_with(4.21 * unit**2, 0)[0], source, level)
    assert agree()
    assert agree(there=4.0, back=2.24)  # either below 1.5 * 1.5
    assert agree(there=2.24, back=99.0)
    assert not agree(there=2.26, back=2.26)
    assert agree(shift=2.9 * unit)
    assert not agree(shift=3.1 * unit)
    assert agree(degrees=1.6)
    assert not agree(degrees=1.8)


def test_disagreement_is_where_the_scan_is_not_at_its_origin():
    there, back, source = pair_with(1.0, 1.0, shift=0.5, degrees=1.0)
    shift, turn = disagreement(there, back, source)
    np.testing.assert_allclose((shift, turn), (0.5, 1.0), rtol=1e-6)


def test_the_level_becomes_the_mean_of_the_smaller_errors(monkeypatch):
    levels = []
    fits = SpanningTreeStrategy.fits
    monkeypatch.setattr(
        SpanningTreeStrategy,
        "fits",
        lambda self, there, source, level: levels.append(level) or fits(self, there, source, level),
    )
    views = blobs(3)
    result = run(views, knowing(3))
    unit = views[0].scale.resolution / 1.4
    np.testing.assert_allclose(levels[0], np.mean([view.resolution for view in views]))
    smaller = min(pair.trimmed_mse for pair in result.pairs[:2])
    np.testing.assert_allclose(levels[1], smaller / unit)
    assert truth(3).keys() == result.poses.keys()


@pytest.mark.parametrize("name", ["first_factor", "max_rotation", "reference_resolution"])
def test_parameters_out_of_range_are_refused_by_name(name):
    with pytest.raises(mvreg.InputError, match=f"^{name}: expected a positive number, got 0"):
        SpanningTreeStrategy(**{name: 0.0})
