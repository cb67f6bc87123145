"""Views at full resolution, as targets of the final refinement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mvreg.geometry.nearest import mean_spacing
from mvreg.parallel import in_threads
from mvreg.surface.normals import facing_normals
from mvreg.types import View


def dense(views: Sequence[View]) -> list[View]:
    """The views with every raw point of their scans, and normals there.

    Closest points in a down-sampled view are off by its sampling, which biases point-to-point
    refinement; among all the raw points the bias is negligible. Sources may stay down-sampled. A
    view without a scan is returned as it is. Keypoints and descriptors are kept.
    """
    return in_threads(_dense, views)


def _dense(view: View) -> View:
    scan = view.scan
    if scan is None:
        return view
    normals = facing_normals(scan, scan.points, view.features)
    spacing = mean_spacing(scan.points, scan.tree)
    return replace(view, points=scan.points, normals=normals, resolution=spacing)
