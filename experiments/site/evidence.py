"""A figure of the evidence: what is measured of a pose that is turned away from the right one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import mvreg
from experiments.common.style import canvas
from mvreg.evidence.pairing import view_pairs
from mvreg.evidence.pooled import Evidence, pool_evidence
from mvreg.geometry import se3
from mvreg.types import Array, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Degrees that the source is turned by, and axes through its middle, drawn at random, to mean over.
ANGLES = np.concatenate([np.linspace(0, 2, 9), np.linspace(2.5, 10, 11)])
AXES = 12
#: What is drawn of the evidence: its name, its limits, and what it says.
MEASURED = (
    ("surface_overlap", (0, 1), "surface overlap"),
    ("residual", (0, None), "residual / noise floor"),
    ("agreement", (0, 1), "share of normals that agree"),
    ("violation", (0, None), "free-space violation"),
    ("residual_step", (0, None), "residual step (resolutions)"),
    ("probability", (0, 1), "probability of being right"),
)
#: Data sets and their pairs of scans, source first.
PAIRS = (
    ("figurine", "figurine_01", "figurine_00", "#0072B2"),
    ("room", "room_01", "room_00", "#D55E00"),
    ("street", "street_08", "street_07", "#009E73"),
)


def draw_evidence() -> Figure:
    """Each of the measured quantities against the angle by which the pose is off."""
    figure = canvas(4.6)
    axes = figure.subplots(2, 3).ravel()
    for name, source, target, colour in PAIRS:
        scans = mvreg.dataset(name)
        assert scans.poses is not None
        views = {view.name: view for view in mvreg.prepare(scans)}
        truth = se3.invert(scans.poses[target]) @ scans.poses[source]
        found = [turned(views[source], views[target], truth, angle) for angle in ANGLES]
        for axis, (what, _, label) in zip(axes, MEASURED, strict=True):
            values = [np.mean([getattr(one, what) for one in each]) for each in found]
            axis.plot(ANGLES, values, color=colour, label=name)
            axis.set_title(label)
    for axis, (_, limits, _) in zip(axes, MEASURED, strict=True):
        axis.set_ylim(*limits)
    for axis in axes[3:]:
        axis.set_xlabel("turned by (degrees)")
    axes[0].legend()
    figure.tight_layout()
    return figure


def turned(source: View, target: View, truth: Array, angle: float) -> list[Evidence]:
    """The evidence of the true pose turned about the middle of the source, about several axes."""
    rng = np.random.default_rng(0)
    axes = rng.normal(size=(AXES, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    middle = source.points.mean(axis=0)
    found = []
    for axis in axes:
        turn = se3.about(middle, se3.exp(np.concatenate([np.deg2rad(angle) * axis, np.zeros(3)])))
        found.append(pool_evidence(view_pairs(source, target, truth @ turn)))
    return found
