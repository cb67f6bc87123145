"""The distance of the Stanford ground truth from the poses at which the scans fit best.

    python -m experiments.accuracy.floor bunny dragon buddha

Starts from the ``.conf`` poses, and from the same spoilt a little, measures every overlapping pair
with point-to-plane ICP, and averages the motions. Where that ends is where the scans fit each other
best; errors against the ``.conf`` that are smaller than its distance measure the ``.conf``. Writes
``experiments/results/floor.md``.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from datetime import date
from importlib.metadata import version
from pathlib import Path

import numpy as np
from rich.progress import track

import mvreg
from mvreg.evaluation.pose_errors import consistency, pose_errors
from mvreg.geometry import se3
from mvreg.stages.adjust.motion_averaging import MotionAveraging
from mvreg.stages.refine.planes import PointToPlane
from mvreg.types import Array, Result, View

RESULTS = Path(__file__).parents[1] / "results" / "floor.md"
#: The spoilt start: each pose but the first is turned and shifted, at random, by so much.
DEGREES, RESOLUTIONS = 1.0, 1.0

HEAD = """# The floor: how far the ground truth can be trusted

`python -m experiments.accuracy.floor {names}`, mvreg {version}, {date}.

Motion averaging over all overlapping pairs, registered by point-to-plane ICP against all raw
points, starting from the `.conf` poses and from the same poses rotated by {degrees:g} degree and
translated by {resolutions:g} resolution, each scan in a random direction. e_R and e_t are relative
to the `.conf` poses in the frame of the first scan, averaged over the scans; e_t in mm. Consistency
is the point-to-plane distance between overlapping surfaces in resolutions, median / RMS; it needs
no ground truth.

The rows "optimum" give the distance from the `.conf` poses to those at which the scans fit best;
the latter fit better than the `.conf` poses, and hardly depend on the starting point. Errors below
this distance cannot be attributed to a method: they are within the uncertainty of the ground truth.

| | poses | e_R | e_t | consistency |
|---|---|---|---|---|
"""


def spoilt(
    poses: Mapping[str, Array], views: list[View], rng: np.random.Generator
) -> dict[str, Array]:
    """Poses, all but the first, rotated about the scans' centroids and translated a little."""
    found = dict(poses)
    for view in views[1:]:
        axis, way = (x / np.linalg.norm(x) for x in rng.normal(size=(2, 3)))
        turn = se3.exp(np.concatenate([np.deg2rad(DEGREES) * axis, np.zeros(3)]))
        middle = view.points.mean(axis=0)
        shift = middle - turn[:3, :3] @ middle + RESOLUTIONS * view.scale.resolution * way
        found[view.name] = poses[view.name] @ se3.from_parts(turn[:3, :3], shift)
    return found


def measure(name: str) -> list[str]:
    """Rows of the table for one data set."""
    scanset = mvreg.dataset(name)
    if scanset.poses is None:
        raise mvreg.InputError(f"{name} has no ground truth")
    rng = np.random.default_rng(0)
    pipeline = replace(mvreg.load_method("fcpma").pipeline, refine=PointToPlane())
    views = pipeline.prepare(scanset.scans, rng)
    views = [view for view in views if view.name in scanset.poses]
    first = views[0].name
    base = se3.invert(scanset.poses[first])
    truth = {view.name: base @ scanset.poses[view.name] for view in views}
    truth[first] = np.eye(4)
    starts = {"`.conf`": truth, "spoilt": spoilt(truth, views, rng)}
    rows = []
    for label, poses in track(list(starts.items()), description=name):
        found = MotionAveraging()(Result(first, poses, (), ()), views, pipeline)
        rows.append(row(name, label, poses, truth, views))
        rows.append(row(name, f"optimum, from {label}", found.poses, truth, views))
    return rows


def row(
    name: str, label: str, poses: Mapping[str, Array], truth: Mapping[str, Array], views: list[View]
) -> str:
    """One line of the table."""
    errors, fit = pose_errors(poses, truth, views[0].name), consistency(poses, views)
    if errors is None or fit is None:
        raise mvreg.InputError(f"{name}: no two scans that overlap have a ground truth")
    return (
        f"| {name} | {label} | {errors.mean.rotation:.4f} | {errors.mean.translation:.3f} | "
        f"{fit.relative_median:.3f} / {fit.relative_rms:.3f} |"
    )


def main(names: list[str]) -> None:
    """Print the table, and keep it."""
    rows = [row for name in names for row in measure(name)]
    head = HEAD.format(
        names=" ".join(names),
        version=version("mvreg"),
        date=date.today(),
        degrees=DEGREES,
        resolutions=RESOLUTIONS,
    )
    RESULTS.write_text(head + "\n".join(rows) + "\n")
    print("\n".join(rows))


if __name__ == "__main__":
    main(sys.argv[1:] or ["bunny", "dragon", "buddha"])
