"""The histogram of residuals, and cross-sections as paths of SVG."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mvreg.report import formatting
from mvreg.report.page.colours import GREY
from mvreg.report.page.sections import Section
from mvreg.types import Array

Row = dict[str, Any]
#: Bars of the histogram.
BARS = 40
#: The whole of a section is drawn this much smaller than its square.
MARGIN = 1.05


def histogram(residuals: Mapping[str, Array], report: Mapping[str, Any]) -> Row:
    """Counts of residuals in `BARS` bars, up to three times their tolerance.

    Parameters
    ----------
    residuals : mapping of scan name to (M,) array
        Lengths; what is not finite is left out.
    report : mapping
        As in ``result.json``, for the tolerance.
    """
    known = [values[np.isfinite(values)] for values in residuals.values()]
    values = np.concatenate(known) if known else np.empty(0)
    tolerance = (report.get("grades") or {}).get("tolerance")
    if not len(values) or not tolerance:
        return {"counts": [], "top": 0.0, "tolerance": 0.0, "share": 0.0}
    top = 3 * float(tolerance)
    counts = np.histogram(np.minimum(values, top * (1 - 1e-9)), BARS, (0, top))[0]
    return {
        "counts": counts.tolist(), "top": top, "tolerance": float(tolerance),
        "share": float((values <= tolerance).mean()), "median": float(np.median(values)),
        "p95": float(np.quantile(values, 0.95)),
    }  # fmt: skip


def drawn(one: Section, colours: Mapping[str, str], report: Mapping[str, Any]) -> Row:
    """A section as paths of SVG, in squares of 1000 by 1000: all of it, and a part enlarged.

    `box` is the left and upper corner and the side of that part in the whole.
    """
    corners = [np.full((1, 2), -one.half), np.full((1, 2), one.half)]
    everything = np.concatenate([*corners, *one.whole.values()])
    low, high = everything.min(axis=0), everything.max(axis=0)
    middle, extent = (low + high) / 2, MARGIN * float((high - low).max()) / 2
    side = 500 * one.half / extent
    x, y = 500 + 500 * middle * [-1, 1] / extent
    return {
        "apart": formatting.length(one.apart, report),
        "half": formatting.length(one.half, report),
        "box": [float(x) - side, float(y) - side, 2 * side],
        "whole": _paths({name: p - middle for name, p in one.whole.items()}, extent, colours),
        "enlarged": _paths(one.enlarged, one.half, colours),
    }


def _paths(points: Mapping[str, Array], half: float, colours: Mapping[str, str]) -> list[Row]:
    found = []
    for name, flat_points in points.items():
        places = np.round(500 + 500 * flat_points * [1, -1] / half).astype(int)
        places = np.unique(places, axis=0)
        found.append({
            "name": name, "colour": colours.get(name, GREY),
            "path": "".join(f"M{x} {y}h0" for x, y in places.tolist()),
        })  # fmt: skip
    return found
