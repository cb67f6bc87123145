"""Of many overlapping views enough pairs are kept, well spread."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mvreg.geometry import se3
from mvreg.surface.partners import well_spread

RNG = np.random.default_rng(4)


def ring(count, width):
    """Views around a cylinder of radius 30, each as wide as `width` (radians), in own frames."""
    points, poses = [], []
    for k in range(count):
        angle = 2 * np.pi * k / count + RNG.uniform(-width / 2, width / 2, 500)
        cloud = np.column_stack([30 * np.cos(angle), 30 * np.sin(angle), RNG.uniform(0, 40, 500)])
        pose = se3.random(RNG, 100.0)
        points.append(se3.apply(se3.invert(pose), cloud))
        poses.append(pose)
    return points, poses


def everything(count):
    return [(i, j) for i in range(count) for j in range(i + 1, count)]


def test_that_few_views_keep_all_their_pairs():
    points, poses = ring(9, 2.0)
    pairs = everything(9)
    assert well_spread(pairs, points, poses, 1.0, most=8) == pairs


@pytest.mark.parametrize("both", [False, True])
def test_that_pairs_grow_with_the_views_and_join_all_of_them(both):
    points, poses = ring(80, 2.0)
    pairs = everything(80)
    pairs = sorted([*pairs, *((j, i) for i, j in pairs)]) if both else pairs
    kept = well_spread(pairs, points, poses, 1.0, most=8)
    assert len(kept) <= 80 * 9 * (2 if both else 1)
    assert [pair for pair in pairs if pair in set(kept)] == kept
    if both:
        assert {(j, i) for i, j in kept} == set(kept)
    rows, columns = np.array(kept).T
    graph = coo_array((np.ones(len(kept)), (rows, columns)), shape=(80, 80))
    assert connected_components(graph, directed=False)[0] == 1
    # Partners lie on both sides: the seam of a view with its next ones alone would drift.
    for i in range(80):
        others = {j for pair in kept for j in pair if i in pair} - {i}
        steps = [(j - i + 40) % 80 - 40 for j in others]
        assert min(steps) < -5 and max(steps) > 5


def test_that_what_is_kept_does_not_depend_on_the_frame_or_the_unit():
    points, poses = ring(40, 2.0)
    kept = well_spread(everything(40), points, poses, 1.0, most=6)
    scaled = [se3.from_parts(pose[:3, :3], 1e3 * pose[:3, 3]) for pose in poses]
    assert kept == well_spread(everything(40), [1e3 * p for p in points], scaled, 1e3, most=6)
