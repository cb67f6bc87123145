"""Confidence in the poses, drawn: a labelled dot per scan, a line per pair.

Rerun takes half a second to import, so every function imports it for itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mvreg.geometry import se3
from mvreg.observers.rerun.archetypes import GREEN, GREY, RED, YELLOW, Color
from mvreg.report.formatting import confidence
from mvreg.types import Array, View

COLORS = {"green": GREEN, "amber": YELLOW, "red": RED}


def middles(poses: Mapping[str, Array], views: Mapping[str, View]) -> dict[str, Array]:
    """Where the middle of each scan is drawn (3,)."""
    return {
        name: se3.apply(pose, views[name].points.mean(axis=0))
        for name, pose in poses.items()
        if name in views and len(views[name].points)
    }


def dots(spots: Mapping[str, Array], report: Mapping[str, Any]) -> Any:
    """A dot for each scan in the colour of its grade, with its name, grade and confidence."""
    import rerun as rr

    found = {row["name"]: row.get("assessment") or {} for row in report.get("scans", [])}
    said = [found.get(name, {}) for name in spots]
    labels = [
        " ".join([name, each["grade"], confidence(each.get("confidence"))])
        if each.get("grade")
        else name
        for name, each in zip(spots, said, strict=True)
    ]
    colors = [COLORS.get(str(each.get("grade")), GREY) for each in said]
    return rr.Points3D(
        np.array(list(spots.values()), dtype=np.float32).reshape(-1, 3), colors=colors,
        labels=labels, show_labels=True, radii=rr.Radius.ui_points(6.0),
    )  # fmt: skip


def lines(spots: Mapping[str, Array], report: Mapping[str, Any]) -> Any:
    """A line for each pair that overlaps, in the colour of what the two alone show."""
    import rerun as rr

    limits = report.get("grades") or {}
    known = [
        link for link in report.get("links") or []
        if link["source"] in spots and link["target"] in spots
    ]  # fmt: skip
    strips = np.array([(spots[link["source"]], spots[link["target"]]) for link in known])
    return rr.LineStrips3D(
        strips.reshape(-1, 2, 3).astype(np.float32),
        colors=[color_of(link["confidence"], limits) for link in known] or None,
        labels=[confidence(link["confidence"]) for link in known] or None,
        show_labels=False,
    )


def color_of(probability: float, limits: Mapping[str, float]) -> Color:
    """The colour of a confidence; `limits` are the report's ``grades``."""
    if probability >= limits.get("confidence", 1.0):
        return GREEN
    return YELLOW if probability >= limits.get("amber_confidence", 1.0) else RED
