"""How far the ground truth of the Stanford scans is from the optimum of the scans themselves.

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

Motion averaging over all pairs that overlap, measured with point-to-plane ICP against all raw
points, started from the `.conf` poses and from the same poses turned by {degrees:g} degree and
shifted by {resolutions:g} resolution, each scan in a direction of its own. e_R and e_t are against
the `.conf`, in the frame of the first scan, means over the scans; e_t in mm. Consistency is the
point-to-plane distance of overlapping surfaces in resolutions, median / RMS: it asks no truth.

The poses that the scans themselves ask for are as far from the `.conf` as the rows "optimum" say,
and fit the scans better than the `.conf` does; where the search starts makes little difference. A
method whose errors are no larger than that cannot be told from one without any.

| | poses | e_R | e_t | consistency |
|---|---|---|---|---|
"""


def spoilt(
    poses: Mapping[str, Array], views: list[View], rng: np.random.Generator
) -> dict[str, Array]:
    """Poses off by a turn about the middle of the scan and a shift; the first view's stays."""
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
