"""Figures of the guides: places and a heap of objects, registered; a yard with two answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import mvreg
from experiments.common.render import Cloud, laid_out, render, together
from experiments.common.style import GREY, canvas, scan_colours
from mvreg.evidence.pairing import view_pairs
from mvreg.evidence.pooled import pool_evidence
from mvreg.geometry import se3
from mvreg.surface.normals import Orient, estimate_normals
from mvreg.types import Array, Scan, ScanSet, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Data sets from above, and what height of them is shown (m): walls and furniture, no ceiling.
SHOWN = {"room": (0.2, 2.0), "office": (0.2, 2.0), "street": (0.3, 12.0), "desk": (-9.0, 9.0)}
#: Points of a scan that are drawn.
DRAWN = 4000
UNJOINED = "#B0B0B0"


def upright_truth(scans: ScanSet, poses: Any, reference: str) -> dict[str, Array]:
    """Poses in the frame of the scene, with the reference in its true place: to draw them."""
    assert scans.poses is not None
    return {name: scans.poses[reference] @ pose for name, pose in poses.items()}


def thinned(scan: Scan) -> Array:
    """Some of the points (N, 3) of a scan, evenly from its list."""
    return scan.points[:: max(1, len(scan.points) // DRAWN)]


def draw_places() -> Figure:
    """Four data sets as registered from shuffled, moved scans, seen from above."""
    figure = canvas(6.4)
    for axis, (name, heights) in zip(figure.subplots(2, 2).ravel(), SHOWN.items(), strict=True):
        scans = mvreg.dataset(name, rng=1, order="shuffle", scramble=True)
        result = mvreg.register(scans, rng=1)
        parts = [(result.reference, result.poses)]
        parts += [(next(iter(part)), part) for part in result.components]
        by_name = {scan.name: scan for scan in scans.scans}
        colours = dict(zip(sorted(by_name), scan_colours(len(by_name)), strict=True))
        for number, (reference, poses) in enumerate(parts):
            placed = upright_truth(scans, poses, reference)
            for scan_name, pose in placed.items():
                points = se3.apply(pose, thinned(by_name[scan_name]))
                points = points[(points[:, 2] > heights[0]) & (points[:, 2] < heights[1])]
                colour = UNJOINED if number else colours[scan_name]
                axis.scatter(*points[:, :2].T, s=0.25, color=colour, linewidths=0, rasterized=True)
        joined = f"{len(result.poses)} of {len(scans.scans)} scans in one model"
        axis.set_title(f"{name}: {joined}")
        axis.set_aspect("equal")
        axis.set(xlabel="m")
    figure.tight_layout()
    return figure


def draw_heap() -> Figure:
    """Scans of two objects as they come, and the two models made of them."""
    sets = [
        mvreg.dataset("figurine"),
        mvreg.dataset("figurine", shape="blob-0", views=8),
    ]
    scans = [scan for each in sets for scan in each.scans]
    order = np.random.default_rng(1).permutation(len(scans))
    scans = [scans[k] for k in order]
    result = mvreg.register(scans, rng=1)
    colours = dict(zip((s.name for s in scans), scan_colours(len(scans)), strict=True))
    clouds = {
        scan.name: Cloud(
            scan.points, estimate_normals(scan, scan.points, Orient.auto, 30),
            np.broadcast_to(colours[scan.name], scan.points.shape),
        )
        for scan in scans
    }  # fmt: skip
    models = []
    for poses in (result.poses, *result.components):
        truth = next(each.poses for each in sets if each.poses and next(iter(poses)) in each.poses)
        first = next(iter(poses))
        stand = truth[first] @ se3.invert(poses[first])
        models.append(together([clouds[n].moved(facing() @ stand @ T) for n, T in poses.items()]))
    figure = canvas(2.6)
    axes = figure.subplots(1, 2, width_ratios=(2.2, 1))
    images = (
        render(laid_out(list(clouds.values()), 7, 165, 165), 7 * 165, 3 * 165, 0.9),
        render(laid_out(models, 2, 170, 175), 2 * 170, 180, 2.0),
    )
    titles = (f"{len(scans)} scans of two objects", f"{len(models)} models")
    for axis, image, title in zip(axes, images, titles, strict=True):
        axis.imshow(image)
        axis.set_axis_off()
        axis.set_title(title)
    figure.tight_layout()
    return figure


def facing() -> Array:
    """From the frame of the figures, z up, to one that is looked at along -z, y up."""
    turn: Array = np.eye(4)
    turn[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    return turn


def draw_yard() -> Figure:
    """One pair of scans of the yard in the two poses that fit, with their probabilities."""
    method = mvreg.load_method("auto")
    scans = mvreg.dataset("yard")
    views = {v.name: v for v in mvreg.prepare(scans, method)}
    source, target = views["yard_04"], views["yard_00"]
    figure = canvas(3.6)
    rivals = two_poses(method, source, target)
    for axis, (pose, probability) in zip(figure.subplots(1, 2), rivals, strict=True):
        for view, motion, colour in ((target, np.eye(4), "#0072B2"), (source, pose, "#D55E00")):
            assert view.scan is not None
            points = se3.apply(motion, thinned(view.scan))
            axis.scatter(*points[:, :2].T, s=0.3, color=colour, linewidths=0)
        where = se3.apply(pose, np.zeros((1, 3)))[0]
        axis.plot(0, 0, "^", color="#0072B2", markeredgecolor="white")
        axis.plot(*where[:2], "^", color="#D55E00", markeredgecolor="white")
        shown = f"{probability:.2f}" if probability < 0.995 else ">0.99"
        axis.set_title(f"probability by itself: {shown}")
        axis.set(xlim=(-9, 9), ylim=(-14, 6))
        axis.set_aspect("equal")
    figure.text(0.5, 0.01, "triangles: where the two scanners stood", ha="center", color=GREY)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    return figure


def two_poses(method: mvreg.Method, source: View, target: View) -> list[tuple[Array, float]]:
    """The best two poses of a pair that differ by a turn, the more probable first."""
    pipeline = method.pipeline
    found = pipeline.propagate(
        source, target, pipeline.seed(source, target), np.random.default_rng(0)
    )
    refined = [pipeline.refine(source, target, pose).T_target_source for pose in found.poses]
    weighed = [
        (pose, pool_evidence(view_pairs(source, target, pose)).plausibility) for pose in refined
    ]
    weighed.sort(key=lambda one: -one[1])
    best = weighed[0]
    turned = [w for w in weighed if se3.rotation_angle(w[0], best[0]) > np.pi / 4]
    return [best, turned[0]]
