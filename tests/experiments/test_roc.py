"""ROC curves against examples worked by hand, and how a pair is told right."""

from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.testing import blob_scans, overlap
from mvreg.types import Registration


def pair(right, ratio=0.5, residual=0.3, agreement=0.9, overlap=0.5, localizability=0.1):
    from experiments.calibration.raw_pairs import RawPair

    return RawPair("a", "b", 0.5, 1.0, 1.0, right, ratio, 1.0, residual, agreement, overlap,
                   localizability)  # fmt: skip


def test_a_curve_worked_by_hand():
    from experiments.calibration.roc import area, curve

    scores = np.array([0.1, 0.4, 0.3, 0.2, 0.5])
    right = np.array([True, True, False, True, False])
    # Accepted in turn: right, right, wrong, right, wrong.
    across, up = curve(scores, right)
    np.testing.assert_allclose(across, [0, 0, 0, 1 / 2, 1 / 2, 1])
    np.testing.assert_allclose(up, [0, 1 / 3, 2 / 3, 2 / 3, 1, 1])
    assert area(scores, right) == pytest.approx(5 / 6)


def test_ties_count_half():
    from experiments.calibration.roc import area, curve

    scores, right = np.array([1.0, 1.0, 2.0]), np.array([True, False, True])
    across, up = curve(scores, right)
    np.testing.assert_allclose(across, [0, 1, 1])
    np.testing.assert_allclose(up, [0, 1 / 2, 1])
    assert area(scores, right) == pytest.approx(1 / 4)


def test_the_area_is_the_share_of_pairs_in_order(rng):
    from experiments.calibration.roc import area

    scores, right = rng.integers(0, 20, 200).astype(float), rng.random(200) < 0.4
    good, bad = scores[right][:, None], scores[~right]
    assert area(scores, right) == pytest.approx(((good < bad) + 0.5 * (good == bad)).mean())


def test_the_thresholds_in_use():
    from experiments.calibration.roc import accepted

    pairs = [pair(True), pair(False, ratio=1.1), pair(False, residual=0.6),
             pair(False, agreement=0.7), pair(False, localizability=0.001)]  # fmt: skip
    assert accepted(pairs, "tmse").tolist() == [True, False, True, True, True]
    assert accepted(pairs, "residual").tolist() == [True, True, False, True, True]
    assert accepted(pairs, "both").tolist() == [True, False, False, False, False]


def test_the_figure_says_how_many_and_how_well():
    from matplotlib.text import Text

    from experiments.calibration.roc import draw_roc

    pairs = [pair(True, residual=0.2), pair(True, residual=0.3), pair(False, residual=0.25)]
    figure = draw_roc({"bunny": pairs, "dragon": []})
    found = {text.get_text() for text in figure.findobj(Text)}
    assert {"bunny: 2 right, 1 wrong", "point-to-plane: AUC 0.500", "not run"} <= found


def test_pairs_are_kept_and_not_registered_again(tmp_path, monkeypatch):
    from experiments.calibration import raw_pairs

    calls = []
    monkeypatch.setattr(raw_pairs, "register_all", lambda name: calls.append(name) or [pair(True)])
    first = dict(raw_pairs.cached(["bunny", "dragon"], tmp_path))
    assert dict(raw_pairs.cached(["bunny", "dragon"], tmp_path)) == first
    assert first == {"bunny": [pair(True)], "dragon": [pair(True)]}
    assert calls == ["bunny", "dragon"]


def registration(source, target, pose):
    distances, partners = target.tree.query((source.points @ pose[:3, :3].T) + pose[:3, 3])
    kept = np.argsort(distances, kind="stable")[: len(distances) // 2]
    return Registration(source.name, target.name, pose, 0.5, float((distances[kept] ** 2).mean()),
                        1.0, np.stack([kept, partners[kept]], axis=1), distances[kept],
                        float(distances[kept].max()), 1, True)  # fmt: skip


def test_right_is_near_the_truth_and_needs_overlap():
    from experiments.calibration.raw_pairs import LEAST, measure

    pair = overlap()
    source, target, truth = pair.source, pair.target, pair.T_target_source
    found = measure(registration(source, target, truth), source, target, truth)
    assert found.right and found.angle < 1e-4 and found.shift < 1e-9
    assert found.true_overlap > LEAST and 0 < found.residual < 1
    shifted = truth.copy()
    shifted[0, 3] += 6 * source.scale.resolution
    moved = measure(registration(source, target, shifted), source, target, truth)
    assert not moved.right and moved.shift == pytest.approx(6)
    apart = replace(target, points=target.points + 1e6)
    met = measure(registration(source, apart, truth), source, apart, truth)
    assert met.true_overlap == 0 and met.angle == 0 and not met.right


def test_a_set_without_truth_is_refused(monkeypatch):
    from experiments.calibration.raw_pairs import register_all

    scans = blob_scans(2)
    monkeypatch.setattr(mvreg, "dataset", lambda name: replace(scans, poses=None))
    with pytest.raises(mvreg.InputError, match="no ground truth"):
        register_all("bunny")
