"""Figures of the decisions: attempts among the scans of the office, and how sure the poses are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import mvreg
from experiments.common.style import GREY, canvas
from mvreg.geometry import se3
from mvreg.types import Array, Result, ScanSet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ACCEPTED, REFUSED, LOOP = "#0072B2", "#CC3311", "#E69F00"
COMPONENTS = ("#0072B2", "#009E73", "#CC79A7")


def draw_graph() -> Figure:
    """The attempts of a run on the office, over the true positions of the scanners."""
    scans = mvreg.dataset("office", rng=1, order="shuffle", scramble=True)
    result = mvreg.register(scans, rng=1)
    assert scans.poses is not None
    where = {name: pose[:2, 3] for name, pose in scanner_places(scans).items()}
    figure = canvas(3.9)
    left, right = figure.subplots(1, 2)
    for pair in result.pairs:
        ends = np.stack([where[pair.source], where[pair.target]])
        loop = "loop_probability" in pair.verdict.evidence
        joined = pair.verdict.reliable
        colour = LOOP if loop else ACCEPTED if joined else REFUSED
        left.plot(*ends.T, color=colour, lw=1.6 if joined else 0.7, zorder=2 if joined else 1,
                  alpha=1 if joined else 0.6)  # fmt: skip
    members = [result.poses, *result.components]
    for axis in (left, right):
        for colour, names in zip(COMPONENTS, members, strict=False):
            for name in names:
                axis.plot(*where[name], "o", color=colour, zorder=3)
        for name, place in where.items():
            axis.annotate(name.rpartition("_")[2], place, fontsize=6, xytext=(3, 3),
                          textcoords="offset points")  # fmt: skip
        axis.set_aspect("equal")
        axis.set_axis_off()
    for link in result.links:
        ends = np.stack([where[link.source], where[link.target]])
        right.plot(*ends.T, color=GREY, lw=0.3 + link.points / 2500, alpha=0.4, zorder=1)
    made = sum(pair.verdict.reliable for pair in result.pairs)
    left.set_title(f"{len(result.pairs)} attempts, {made} accepted")
    right.set_title("overlaps that hold the poses in the end")
    legend(left, {line.get_color() for line in left.lines})
    figure.tight_layout()
    return figure


def legend(axis: Any, shown: set[str]) -> None:
    """What the colours of the lines say, of those that are there."""
    for colour, label in (
        (ACCEPTED, "accepted by itself"), (LOOP, "accepted in a loop"), (REFUSED, "refused"),
    ):  # fmt: skip
        if colour in shown:
            axis.plot([], [], color=colour, label=label)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, 0.02), ncols=3, handlelength=1)


def scanner_places(scans: ScanSet) -> dict[str, Array]:
    """The true pose of each scanner, which stood at the origin before its scan was moved."""
    assert scans.poses is not None
    places = {}
    for scan in scans.scans:
        pose = scans.poses[scan.name].copy()
        if scan.view_point is not None:
            pose[:3, 3] = se3.apply(scans.poses[scan.name], scan.view_point[None])[0]
        places[scan.name] = pose
    return places


def draw_adjustment() -> Figure:
    """Errors of positions along the street beside the standard deviations that are told."""
    scans = mvreg.dataset("street", rng=1)
    assert scans.poses is not None
    before = mvreg.register(scans, changes={"adjust": "none"}, rng=1)
    after = mvreg.register(scans, rng=1)
    figure = canvas(3.0)
    left, right = figure.subplots(1, 2)
    names = [scan.name for scan in scans.scans]
    for result, colour, label in ((before, "#E69F00", "before"), (after, "#0072B2", "after")):
        errors, deviations = along(scans, result, names)
        left.plot(range(len(names)), 1000 * errors, "o-", color=colour, ms=3, label=label)
        if result.covariances:
            left.fill_between(range(len(names)), 2000 * deviations, color=colour, alpha=0.15, lw=0,
                              label="two standard deviations")  # fmt: skip
    left.set(xlabel="scan along the street", ylabel="error of the position (mm)", ylim=(0, None))
    left.set_title("each scan's position, beside the reference's")
    left.legend()
    ratios = calibrated()
    right.hist(ratios, bins=np.linspace(0, 4, 21), density=True, color="#56B4E9")
    grid = np.linspace(0, 4, 200)
    right.plot(grid, np.sqrt(2 / np.pi) * grid**2 * np.exp(-(grid**2) / 2), color="black", lw=1,
               label="if they were exact")  # fmt: skip
    right.set(xlabel="error in standard deviations (three axes)", ylabel="density")
    right.set_title(f"{len(ratios)} poses of the figurine, noise drawn anew")
    right.legend()
    figure.tight_layout()
    return figure


def along(scans: ScanSet, result: Result, names: list[str]) -> tuple[Array, Array]:
    """Errors of the scanners' positions in the reference's frame, and standard deviations."""
    assert scans.poses is not None
    reference = se3.invert(scans.poses[result.reference])
    errors, deviations = [], []
    for name in names:
        true = (reference @ scans.poses[name])[:3, 3]
        errors.append(float(np.linalg.norm(result.poses[name][:3, 3] - true)))
        deviations.append(float(np.sqrt(np.trace(position(result, name)))))
    return np.array(errors), np.array(deviations)


def position(result: Result, name: str) -> Array:
    """The covariance (3, 3) of a scanner's position in the model frame."""
    if name not in result.covariances:
        return np.full((3, 3), np.nan)
    change = np.hstack([-se3.skew(result.poses[name][:3, 3]), np.eye(3)])
    covariance: Array = change @ result.covariances[name] @ change.T
    return covariance


def calibrated() -> Array:
    """Errors of positions over their standard deviations, for several draws of the noise."""
    ratios = []
    for noise in range(8):
        scans = mvreg.dataset("figurine", noise_rng=noise)
        result = mvreg.register(scans, rng=1)
        assert scans.poses is not None
        reference = se3.invert(scans.poses[result.reference])
        for name, pose in result.poses.items():
            if name == result.reference:
                continue
            gap = pose[:3, 3] - (reference @ scans.poses[name])[:3, 3]
            ratios.append(float(np.sqrt(gap @ np.linalg.solve(position(result, name), gap))))
    return np.array(ratios)
