"""Figures of the paper's search: one pair of the figurine from seed matches to the refined pose."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import mvreg
from experiments.common.style import GREY, canvas
from mvreg.geometry import se3
from mvreg.types import Array, Indices, Matches, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOURCE, TARGET = "#D55E00", "#0072B2"
RIGHT, WRONG = "#009E73", "#CC3311"
#: A match is right if the true motion brings its keypoints this near (spacings of the keypoints).
NEAR = 1.0
#: Lines that are drawn of a set of matches.
LINES = 60


def draw_search() -> Figure:
    """Seed matches; what one seed spreads to; the consensus; the pose before and after TrICP."""
    method = mvreg.load_method("fcpma")
    scans = mvreg.dataset("figurine")
    assert scans.poses is not None
    views = {view.name: view for view in mvreg.prepare(scans, method)}
    source, target = views["figurine_01"], views["figurine_00"]
    truth = se3.invert(scans.poses[target.name]) @ scans.poses[source.name]
    pipeline = method.pipeline
    seeds = pipeline.seed(source, target)
    found = pipeline.propagate(source, target, seeds, np.random.default_rng(0))
    best, agreeing = found.poses[0], found.matches[0]
    refined = pipeline.refine(source, target, best).T_target_source
    spread = widest(pipeline.propagate, source, target, seeds)
    figure = canvas(5.6)
    axes = figure.subplots(2, 2)
    for axis, matches, title in (
        (axes[0, 0], seeds.indices, f"1. {len(seeds.indices)} seed matches by descriptor"),
        (axes[0, 1], spread, f"2. one of them spread: {len(spread)} matches"),
        (axes[1, 0], agreeing, f"3. RANSAC: {len(agreeing)} agree on one motion"),
    ):
        draw_matches(axis, source, target, matches, truth)
        axis.set_title(title)
    draw_cut(axes[1, 1], source, target, best, refined)
    axes[1, 1].set_title(
        f"4. TrICP: {off(best, truth):.2f} degrees off, then {off(refined, truth):.2f}"
    )
    figure.text(
        0.5, 0.005, "green: right within one spacing of the keypoints, red: wrong; "
        f"at most {LINES} lines are drawn", ha="center", color=GREY,
    )  # fmt: skip
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    return figure


def widest(propagate: Any, source: View, target: View, seeds: Matches) -> Indices:
    """The largest set of matches (M, 2) that one seed spreads to."""
    spread = propagate.spread(source, target, seeds.indices)
    largest: Indices = spread[int(np.argmax(spread.sizes))]
    return largest


def off(pose: Array, truth: Array) -> float:
    """The angle between two poses in degrees."""
    return float(np.rad2deg(se3.rotation_angle(pose, truth)))


def draw_matches(axis: Any, source: View, target: View, matches: Indices, truth: Array) -> None:
    """Both scans side by side, as their sensors saw them, with lines between matching keypoints."""
    apart = 1.15 * float(np.ptp(target.points[:, 0]))
    for view, shift, colour in ((source, 0.0, SOURCE), (target, apart, TARGET)):
        x, y = view.points[:, 0] + shift, view.points[:, 1]
        axis.scatter(x, y, s=0.5, color=colour, alpha=0.35, linewidths=0)
    start = source.features.keypoints[matches[:, 0]]
    end = target.features.keypoints[matches[:, 1]]
    gaps = np.linalg.norm(se3.apply(truth, start) - end, axis=1)
    right = gaps <= NEAR * source.scale.spacing
    drawn = np.linspace(0, len(matches) - 1, min(LINES, len(matches))).astype(int)
    for k in sorted(drawn, key=lambda k: bool(right[k])):
        xs, ys = [start[k, 0], end[k, 0] + apart], [start[k, 1], end[k, 1]]
        axis.plot(xs, ys, color=RIGHT if right[k] else WRONG, lw=0.5, alpha=0.8)
    axis.set_aspect("equal")
    axis.set_axis_off()
    axis.text(0.5, -0.02, f"{right.mean():.0%} of all are right", transform=axis.transAxes,
              ha="center", va="top", color=GREY)  # fmt: skip


def draw_cut(axis: Any, source: View, target: View, rough: Array, fine: Array) -> None:
    """A slab through both scans under the candidate and under the refined pose."""
    assert source.scan is not None and target.scan is not None
    for pose, shift, label in ((rough, -60.0, "candidate"), (fine, 60.0, "refined")):
        for points, colour in (
            (target.scan.points, TARGET), (se3.apply(pose, source.scan.points), SOURCE),
        ):  # fmt: skip
            slab = points[np.abs(points[:, 1] - 20) < 0.8]
            axis.scatter(slab[:, 0] + shift, slab[:, 2], s=0.8, color=colour, linewidths=0)
        axis.text(shift, axis.get_ylim()[0], label, ha="center", va="top", color=GREY)
    axis.set_aspect("equal")
    axis.set_axis_off()
