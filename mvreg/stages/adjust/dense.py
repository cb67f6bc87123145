"""Views with all their raw points, as targets for the last digits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mvreg.geometry.nearest import mean_spacing
from mvreg.parallel import in_threads
from mvreg.surface.normals import facing_normals
from mvreg.types import View


def dense(views: Sequence[View]) -> list[View]:
    """The views with every raw point of their scans, and normals there.

    Closest points in a thinned view are off by its sampling, which pulls a point-to-point
    refinement askew; among all the raw points they are hardly off. Sources may stay thin. A view
    that knows no scan stays as it is. Keypoints and descriptors stay, too.
    """
    return in_threads(_dense, views)


def _dense(view: View) -> View:
    scan = view.scan
    if scan is None:
        return view
    normals = facing_normals(scan, scan.points, view.features)
    spacing = mean_spacing(scan.points, scan.tree)
    return replace(view, points=scan.points, normals=normals, resolution=spacing)
