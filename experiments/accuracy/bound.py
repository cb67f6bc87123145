"""How close adjust=joint comes to the Cramer-Rao bound, on synthetic scans with exact poses.

    python -m experiments.accuracy.bound                        # all shapes: half an hour
    python -m experiments.accuracy.bound --shapes blob-0 --runs 1

Scans of generated shapes with Gaussian noise of the range, unrounded; adjust=joint from spoilt
true poses, and from what the default method's strategy finds. Writes
``experiments/results/bound.md`` and ``bound.png``.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.progress import track

import mvreg
from experiments.accuracy.bound_theory import bound, displacement, scatter
from experiments.accuracy.floor import spoilt
from experiments.common.style import GREY, METHODS, canvas, save, styled
from mvreg.geometry import se3
from mvreg.stages.adjust.joint.stage import JointRefinement
from mvreg.types import Array, Result, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESULTS = Path(__file__).parents[1] / "results"
SHAPES = ("gnome", "blob-0", "blob-1", "blob-2", "blob-3")
#: Standard deviations of the range (mm). Points are about 0.5 mm apart.
NOISES = (0.0, 0.01, 0.03, 0.1, 0.3)
#: Squared errors of six unknowns within this are within the 95 per cent ellipsoid (chi-square).
INSIDE = 12.592
#: Draws of noise and viewpoints. The method is run on the first only: it takes most of the time.
RUNS = 3

HEAD = """# The noise limit

`python -m experiments.accuracy.bound`, mvreg {version}, {date}.

Twelve scans of 30,000 points of synthetic shapes, with exact poses, Gaussian range noise and no
quantisation. `adjust=joint` starts from the true poses perturbed by 1 degree and 1 resolution, and
from the result of the default method. Errors are the RMS displacement of the scans' points against
ground truth in the frame of the first scan (mm), RMS over {runs} draws of noise and viewpoints (for
the method: the first draw). The bound is the Cramer-Rao bound of an unbiased estimator that knows
the noise of every ray but not the surface, from the inverse of the Fisher information matrix.
"Reported" is computed from `Result.covariances`, without ground truth; "squared" is the mean of the
normalised squared errors of the poses, 6 where covariances hold, and "inside" the share of poses
within their 95 per cent ellipsoids.

As the noise decreases, the error approaches a floor set by the sampling of the surface: a patch of
about 45 points is a paraboloid and cannot model finer relief. That floor is the error without
noise; the point spacing is about 0.5 mm. Patches that the points do not follow count less, which
takes most of that floor away. Where noise dominates, the gap between error and bound has two
causes: patches at the rims of scans serve for nothing, although the rays that graze the surface
there hold it best (on the gnome that alone is a factor of 1.4), and relief.

| shape | noise | bound | error | error / bound | from the method | reported | squared | inside |
|---|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Measured:
    """One shape at one noise (mm): RMS over the runs, mm.

    `method` is the error from the default method's result, None where that does not place all
    scans; `squared` the mean normalised squared error of the poses, `inside` the share of poses in
    their 95 per cent ellipsoids.
    """

    shape: str
    noise: float
    bound: float
    error: float
    reported: float
    squared: float
    inside: float
    method: float | None


def measure(shape: str, noise: float, runs: int) -> Measured:
    """Scan a shape, refine, and compare."""
    draws = [one(shape, noise, run) for run in range(runs)]
    least, error, reported = np.sqrt(np.mean([np.square(d.lengths) for d in draws], axis=0))
    squared = np.concatenate([draw.squared for draw in draws])
    return Measured(
        shape, noise, float(least), float(error), float(reported), float(squared.mean()),
        float((squared < INSIDE).mean()), draws[0].method,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Draw:
    """One draw: bound, error, reported error (3,) in mm; squared errors (N - 1,) of poses."""

    lengths: Array
    squared: Array
    method: float | None


def one(shape: str, noise: float, run: int) -> Draw:
    """What `Measured` says, of one draw; the method is asked in the first one only."""
    scanset = mvreg.dataset("figurine", shape=shape, noise=noise, quantisation=0.0, noise_rng=run)
    method, rng = mvreg.load_method(), np.random.default_rng(run)
    views = method.pipeline.prepare(scanset.scans, rng)
    truth, first = rebased(scanset.poses or {}, views), views[0].name
    start = Result(first, spoilt(truth, views, rng), (), ())
    found = JointRefinement()(start, views, method.pipeline)
    least = scatter(views, truth, bound(views, truth, noise)) if noise else 0.0
    error = displacement(views, truth, found.poses)
    reported = scatter(views, truth, found.covariances)
    composed = None if run else from_method(method, views, truth, rng)
    squared = [
        normalised(found.poses[v.name], truth[v.name], found.covariances[v.name]) for v in views[1:]
    ]
    return Draw(np.array([least, error, reported]), np.array(squared), composed)


def normalised(pose: Array, truth: Array, covariance: Array) -> float:
    """The squared error of a pose in units of its covariance (6, 6); 6 in the mean if it holds."""
    error = se3.log(pose @ se3.invert(truth))
    return float(error @ np.linalg.solve(covariance, error))


def from_method(
    method: mvreg.Method, views: list[View], truth: Mapping[str, Array], rng: np.random.Generator
) -> float | None:
    """The error after the method's strategy and adjust=joint; None if not all are placed."""
    placed = method.strategy(views, method.pipeline, rng)
    if len(placed.poses) < len(views):
        return None
    start = Result(views[0].name, rebased(placed.poses, views), (), ())
    refined = JointRefinement()(start, views, method.pipeline)
    return displacement(views, truth, refined.poses)


def rebased(poses: Mapping[str, Array], views: Sequence[View]) -> dict[str, Array]:
    """Poses in the first view's frame."""
    first = views[0].name
    base = se3.invert(poses[first])
    return {view.name: base @ poses[view.name] for view in views} | {first: np.eye(4)}


def row(found: Measured) -> str:
    """One line of the table."""
    ratio = f"{found.error / found.bound:.2f}" if found.bound else ""
    method = "not all placed" if found.method is None else f"{found.method:.4f}"
    return (
        f"| {found.shape} | {found.noise:g} | {found.bound:.4f} | {found.error:.4f} | {ratio} | "
        f"{method} | {found.reported:.4f} | {found.squared:.1f} | {found.inside:.2f} |"
    )


def pooled(found: Sequence[Measured]) -> dict[str, dict[float, Array]]:
    """Bound, error, reported and method's error (4,) by family of shapes and noise, RMS.

    The family of ``blob-3`` is ``blob``; where the method has no answer for one shape, NaN.
    """
    gathered: dict[str, dict[float, list[list[float]]]] = {}
    for item in found:
        method = np.nan if item.method is None else item.method
        rows = gathered.setdefault(item.shape.partition("-")[0], {}).setdefault(item.noise, [])
        rows.append([item.bound, item.error, item.reported, method])
    return {
        family: {noise: np.sqrt((np.array(rows) ** 2).mean(axis=0)) for noise, rows in by.items()}
        for family, by in gathered.items()
    }


def draw(families: Mapping[str, Mapping[float, Array]]) -> Figure:
    """Error against noise, a panel for each family, with the bound as a line."""
    figure = canvas(2.9)
    axes = np.atleast_1d(figure.subplots(1, len(families), sharey=True))
    for axis, (family, by) in zip(axes, families.items(), strict=True):
        noises = sorted(by)
        positive = [noise for noise in noises if noise > 0]
        zero = positive[0] / 3  # where a logarithmic axis shows no noise
        places = [noise or zero for noise in noises]
        values = np.array([by[noise] for noise in noises])
        above = [noise > 0 for noise in noises]
        axis.plot(positive, values[above, 0], color="black", label="Cramer-Rao bound")
        axis.plot(places, values[:, 2], "--", color=GREY, label="reported by the covariances")
        axis.plot(places, values[:, 1], "o", color=METHODS["fcpma"], label="from spoilt truth")
        axis.plot(places, values[:, 3], "x", color=METHODS["surfc"], label="from the method")
        axis.set(xscale="log", yscale="log", title=family, xlabel="noise of the range (mm)")
        axis.set_xticks(places, [f"{noise:g}" for noise in noises])
        axis.minorticks_off()
    axes[0].set_ylabel("RMS displacement (mm)")
    axes[0].legend(loc="upper left")
    figure.tight_layout()
    return figure


def main() -> None:
    """Measure, print and keep the table, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shapes", nargs="+", default=SHAPES)
    parser.add_argument("--noises", nargs="+", type=float, default=NOISES)
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument("--results", type=Path, default=RESULTS)
    chosen = parser.parse_args()
    cases = [(shape, noise) for shape in chosen.shapes for noise in chosen.noises]
    found = [measure(*case, chosen.runs) for case in track(cases, description="bound")]
    head = HEAD.format(version=version("mvreg"), date=date.today(), runs=chosen.runs)
    table = "\n".join(row(item) for item in found)
    chosen.results.mkdir(parents=True, exist_ok=True)
    (chosen.results / "bound.md").write_text(head + table + "\n\n![Error over noise](bound.png)\n")
    with styled():
        save(draw(pooled(found)), chosen.results / "bound.png", colours=64)
    print(table)


if __name__ == "__main__":
    main()
