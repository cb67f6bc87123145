"""How the judge by evidence is calibrated: the fit, the cross-validation, the bins, the page."""

import numpy as np
import pytest

from mvreg.evidence.calibration import CENTRE, FEATURES
from mvreg.geometry import se3
from mvreg.testing import overlap


def drawn(count, weights, seed=0):
    """Poses of random features, right with the probability that the weights say."""
    from experiments.calibration.fit import Sample

    rng = np.random.default_rng(seed)
    features = rng.normal(size=(count, len(FEATURES)))
    chances = 1 / (1 + np.exp(-(weights[0] + features @ weights[1:])))
    return Sample(features, rng.random(count) < chances)


TRUE = np.array([0.5, 1.0, -1.5, 0.0, 0.7, -2.0, -0.3])


def test_the_fit_finds_the_weights_that_the_poses_were_drawn_with(monkeypatch):
    from experiments.calibration import fit

    sample = drawn(20000, TRUE)
    monkeypatch.setattr(fit, "RIGHT", sample.right.mean())
    monkeypatch.setattr(fit, "RIDGE", 1e-6)
    monkeypatch.setattr(fit, "LEAST", (0.0,) * len(FEATURES))
    found = fit.fit([sample], np.zeros(len(FEATURES)))
    np.testing.assert_allclose(found, TRUE, atol=0.12)


def test_every_kind_counts_the_same_with_the_same_share_of_right_poses():
    from experiments.calibration.fit import RIGHT, Sample, weights_of

    def some(right, count, kind):
        return Sample(np.zeros((count, len(FEATURES))), np.arange(count) < right, kind)

    groups = [some(5, 50, "room"), some(2, 10, "room"), some(90, 100, "bunny"), some(0, 7, "a+b")]
    weights = np.split(weights_of(groups), np.cumsum([50, 10, 100])[:3])
    assert sum(one.sum() for one in weights) == pytest.approx(1)
    room, other, bunny, foreign = weights
    assert room.sum() == pytest.approx(other.sum())
    assert room.sum() + other.sum() == pytest.approx(bunny.sum())
    assert room[:5].sum() / room.sum() == pytest.approx(RIGHT)
    assert bunny[:90].sum() / bunny.sum() == pytest.approx(RIGHT)
    assert foreign.sum() / bunny.sum() == pytest.approx(1 - RIGHT)


def test_what_is_nearly_right_is_neither():
    from dataclasses import replace

    from experiments.calibration.poses import NEARLY, SHIFT, Pose, nearly
    from experiments.calibration.scenes import Scene

    pair = overlap()
    scene = Scene({"a": pair.source, "b": pair.target}, {}, {}, None)
    right = Pose("a", "b", "best", [], 0.5, 1.0, 0.9 * SHIFT, right=True)
    wrong = replace(right, shift=1.1 * SHIFT, right=False)
    assert not nearly(scene, right)
    assert nearly(scene, wrong)
    assert not nearly(scene, replace(wrong, shift=1.1 * NEARLY * SHIFT))
    assert not nearly(scene, replace(wrong, true_overlap=0.0))
    assert not nearly(scene, replace(wrong, angle=None, shift=None))


def test_no_feature_counts_the_wrong_way_and_the_excluded_ones_not_at_all():
    from experiments.calibration.fit import LEAST, SIGNS, fit

    found = fit([drawn(2000, -TRUE)], np.zeros(len(FEATURES)), without=(4,))
    counts = found[1:] * SIGNS
    assert found[5] == 0
    assert (np.delete(counts, 4) >= np.delete(LEAST, 4)).all()
    assert len(SIGNS) == len(FEATURES) == len(CENTRE)


def test_a_ridge_keeps_probabilities_modest():
    from experiments.calibration.fit import Sample, fit, predict

    # Told apart without a mistake: without a ridge the weights would grow without end.
    sample = drawn(400, 50 * TRUE)
    weights = fit([Sample(sample.features, sample.right)], np.zeros(len(FEATURES)))
    chances = predict(weights, sample.features, np.zeros(len(FEATURES)))
    assert 0.6 < np.median(chances[sample.right]) < 0.9999


def test_every_group_is_judged_by_other_objects_only():
    from experiments.calibration.fit import cross_validated, kind, kinds

    assert kinds("bunny~noise+dragon") == {"bunny", "dragon"}
    assert kinds("room-1+room-2") == {"room"}
    assert kind("tls_office") == kind("office-1") == "office"
    groups = {"bunny": drawn(500, TRUE, 1), "dragon": drawn(500, TRUE, 2)}
    centre = np.zeros(len(FEATURES))
    asked = {name: sample.features for name, sample in groups.items()}
    before = cross_validated(groups, asked, centre)
    # Other poses of the bunny change what is said of the dragon, but not of the bunny.
    from experiments.calibration.fit import Sample

    groups["bunny~noise"] = Sample(groups["bunny"].features, ~groups["bunny"].right)
    after = cross_validated(groups, asked, centre)
    np.testing.assert_array_equal(after["bunny"], before["bunny"])
    assert np.abs(after["dragon"] - before["dragon"]).max() > 0.1
    # There is nothing else to learn from.
    asked["bunny+dragon"] = asked["bunny"]
    assert "bunny+dragon" not in cross_validated(groups, asked, centre)


def test_the_bins_of_the_reliability_diagram():
    from experiments.calibration.fit import reliability

    chances = np.array([0.05, 0.15, 0.6, 0.8, 1.0])
    right = np.array([False, True, False, True, True])
    found = reliability(chances, right, np.array([0.0, 0.3, 0.5, 1.0]))
    assert [count for *_, count in found] == [2, 3], "empty bins are left out"
    np.testing.assert_allclose(found[0][:2], (0.1, 0.5))
    np.testing.assert_allclose(found[1][:2], (0.8, 2 / 3))


def test_a_line_of_the_page():
    from experiments.calibration.calibrate import Judged, line

    right = np.array([True, True, False, False])
    found = line("known", "bunny", Judged(right, np.array([0.99, 0.61, 0.2, 0.1])), 0.9)
    assert found == "| known | bunny | 4 | 2 | 1.0000 | 50.0% | 0.80 | 0 | 0.200 |"
    wrong = line("known", "a+b", Judged(~right[:2], np.array([0.95, 0.2])), 0.9)
    assert wrong == "| known | a+b | 2 | 0 | - | - | - | 1 | 0.950 |"


def test_groups_of_a_kind_are_counted_together():
    from experiments.calibration.calibrate import Judged, by_kind

    one = Judged(np.array([True, False]), np.array([0.9, 0.2]))
    found = by_kind({"room-1": one, "room-1+room-2": one, "bunny+dragon": one})
    assert set(found) == {"room", "bunny+dragon"}
    assert len(found["room"].right) == 4


def row(right=True, points=900, localizability=0.05, overlap=0.6):
    from experiments.calibration.rows import Row

    return Row("a", "b", "best", right, 0.5, 0.1, 0.1, overlap, 2.0, 0.05, 0.95, 0.01, "known",
               localizability, 0.1, points)  # fmt: skip


def test_what_hardly_meets_or_slides_has_no_chance():
    from experiments.calibration.calibrate import judge, sample

    assert len(sample([row(), row(points=10), row(localizability=0.0)]).right) == 2
    assert len(sample([row(), row(points=10), row(localizability=0.0)], sliding=False).right) == 1
    groups = {
        "dragon": [row(), row(False, overlap=0.1)],
        "bunny": [row(localizability=0.0), row(points=10), row(), row(False, overlap=0.1)],
    }
    found = judge(groups, ())["bunny"]
    np.testing.assert_array_equal(found.chances[:2], 0)
    assert found.chances[2] > found.chances[3] > 0
    np.testing.assert_array_equal(found.right, [True, True, True, False])


def test_figures_are_drawn_of_what_there_is():
    from experiments.calibration.calibrate import Judged
    from experiments.calibration.figures import draw_reliability, draw_roc

    rng = np.random.default_rng(0)
    right = np.arange(40) % 2 == 0
    some = {"bunny": Judged(right, np.where(right, 0.9, 0.1) + 0.05 * rng.random(40))}
    roc = draw_roc({"known": some, "estimated": {}, "none": some})
    titles = [axis.get_title() for axis in roc.axes]
    assert titles[0] == "bunny: 20 right, 20 wrong"
    assert titles[1] == "dragon"
    assert len(roc.axes[0].get_legend().get_texts()) == 2
    assert len(draw_reliability({"known": some}).axes[0].lines) == 2


def test_the_reliability_is_of_the_best_poses():
    from experiments.calibration.calibrate import Judged
    from experiments.calibration.figures import pool

    right, best = np.array([True, False, False]), np.array([True, True, False])
    chances, truth = pool({"a": Judged(right, np.array([0.9, 0.3, 0.1]), best)}, ("a",), best=True)
    np.testing.assert_array_equal(chances, [0.9, 0.3])
    np.testing.assert_array_equal(truth, [True, False])


def test_a_slide_moves_the_overlap_by_what_was_asked_for():
    from experiments.calibration.poses import slide

    pair = overlap()
    length = 3 * pair.source.scale.resolution
    slid = slide(pair.source, pair.target, pair.T_target_source, length, np.random.default_rng(0))
    apart = se3.apply(slid, pair.source.points) - se3.apply(
        pair.T_target_source, pair.source.points
    )
    assert np.sqrt((apart**2).sum(axis=1).mean()) == pytest.approx(length, rel=0.5)
    np.testing.assert_allclose(slid[:3, :3] @ slid[:3, :3].T, np.eye(3), atol=1e-12)
