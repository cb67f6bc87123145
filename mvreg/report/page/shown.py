"""Points for the page: some of each scan, small enough to be embedded."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mvreg.evaluation.residuals import of_raw_points
from mvreg.geometry.nearest import nearest
from mvreg.kernels.moments import normals as plane_normals
from mvreg.parallel import in_threads
from mvreg.types import Array, Scan, View
from mvreg.types.attributes import COLOURS, Values

#: Points shown in all, and of each scan at least and at most: a page of 4 MB for ten scans, of 15
#: MB for 300.
POINTS_IN_ALL, FEWEST, MOST = 150_000, 1500, 40_000
#: Residuals are shown in steps from 0 to this (resolutions); `NONE` is no contact.
WORST, NONE = 1.0, 255
#: Quantiles of the coordinates between which most of a scan lies.
INNER = (0.02, 0.98)


@dataclass(frozen=True, eq=False)
class Shown:
    """Points of one scan as they are shown, in its own frame.

    `residuals` (M,) are lengths, NaN where there is no contact; `colours` (M, 3) are 8 bits, None
    where the scan has none.
    """

    name: str
    points: Array
    normals: Array
    residuals: Array
    colours: Values | None


def shown_points(
    scans: Sequence[Scan], views: Sequence[View], residuals: Mapping[str, Array]
) -> list[Shown]:
    """What is shown of every scan, in the order given.

    Parameters
    ----------
    scans : sequence of Scan
    views : sequence of View
        The same scans as they were prepared; may lack some.
    residuals : mapping of scan name to (M,) array
        Of the registration points, see `mvreg.evaluation.residuals.point_residuals`.
    """
    by_name = {view.name: view for view in views}
    each = int(np.clip(POINTS_IN_ALL // max(len(scans), 1), FEWEST, MOST))
    return in_threads(
        lambda scan: _shown(scan, by_name.get(scan.name), residuals.get(scan.name), each), scans
    )


def _shown(scan: Scan, view: View | None, residuals: Array | None, most: int) -> Shown:
    step = max(1, -(-len(scan.points) // most))
    points = scan.points[::step]
    count = min(20, len(scan.points) - 1)
    found = np.full(len(points), np.nan)
    if view is not None and len(view.points):
        # For the shading those of the registration points do, at a fifth of the time.
        distances, indices = nearest(view.tree, points)
        normals = view.normals[indices]
        if residuals is not None:
            found = of_raw_points(residuals, indices, distances, view)
    elif count > 2:
        normals = plane_normals(scan.tree, points, count)
    else:
        normals = np.zeros_like(points)
    colours = None
    if set(COLOURS) <= scan.attributes.keys():
        values = [scan.attributes[name][::step] for name in COLOURS]
        colours = np.stack([_eight_bits(column) for column in values], axis=1)
    return Shown(scan.name, points, normals, found, colours)


def _eight_bits(column: Values) -> Values:
    """Colours of 8 or 16 bits, or shares from 0 to 1, as 8 bits."""
    if column.dtype == np.uint8:
        return column
    top = 65535.0 if float(column.max(initial=0)) > 255 else 255.0
    if column.dtype.kind == "f" and float(column.max(initial=0)) <= 1:
        top = 1.0
    return np.clip(np.nan_to_num(column) * (255 / top), 0, 255).astype(np.uint8)


def packed(shown: Shown, resolution: float) -> dict[str, Any]:
    """The points of a scan for the page: base64 of small integers, and how to read them.

    Positions are 16 bits along each side of the scan's box, normals 8 bits, residuals 8 bits up to
    `WORST` resolutions.
    """
    low = shown.points.min(axis=0)
    side = np.maximum(np.ptp(shown.points, axis=0).max(), 1e-300)
    cells = np.round((shown.points - low) / side * 65535).astype("<u2")
    steps = np.full(len(shown.residuals), NONE, dtype=np.uint8)
    known = np.isfinite(shown.residuals)
    if resolution > 0:
        share = shown.residuals[known] / (WORST * resolution)
        steps[known] = np.clip(np.round(share * 254), 0, 254)
    found = {
        "count": len(cells),
        "low": low.tolist(),
        "side": float(side),
        # What the view is framed by: a few stray points must not make the rest small.
        "inner": np.quantile(shown.points, INNER, axis=0).tolist(),
        "points": _text(cells),
        "normals": _text(np.round(shown.normals * 127).astype(np.int8)),
        "residuals": _text(steps),
    }
    if shown.colours is not None:
        found["colours"] = _text(np.ascontiguousarray(shown.colours))
    return found


def _text(array: Values) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")
