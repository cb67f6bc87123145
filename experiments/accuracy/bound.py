"""How close adjust=joint comes to the Cramer-Rao bound, on synthetic scans with exact poses.

    python -m experiments.accuracy.bound                        # all: half an hour
    python -m experiments.accuracy.bound --shapes blob-0 room --runs 1 --peers 1
    python -m experiments.accuracy.bound --runs 30 --peers 3    # hours, in pieces if need be
    python -m experiments.accuracy.bound --runs 30 --written    # the page, from what is finished

Scans of generated shapes with Gaussian noise of the range, unrounded, and of rooms seen by the
virtual laser scanner; adjust=joint from spoilt true poses, and from what the default method's
strategy finds; peers' multi-scan refinement from the same poses. Draws are kept in ``runs/bound``,
under a hash of the code: the same command again goes on where it was broken off. Writes
``experiments/results/bound.md`` and ``bound.png``. No Hydra experiment: those sweep over runs of a
method, and nothing here is one.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path

import numpy as np
from rich.progress import track

import mvreg
from experiments.accuracy.bound_draws import Draw, Drawer, summed_up
from experiments.accuracy.bound_page import HEAD, Measured, draw, pooled, row
from experiments.accuracy.bound_peers import PEERS
from experiments.accuracy.bound_theory import bound, displacement, scatter
from experiments.accuracy.floor import spoilt
from experiments.common.style import save, styled
from mvreg.datasets.environments.sets import PHASE_SCANNER
from mvreg.geometry import se3
from mvreg.stages.adjust.joint.stage import JointRefinement
from mvreg.store.content import versions
from mvreg.types import Array, Result, View

RESULTS = Path(__file__).parents[1] / "results"
SHAPES = ("gnome", "blob-0", "blob-1", "blob-2", "blob-3")
#: Scenes seen by the virtual laser scanner; their noise is a multiple of its own.
SCENES = ("room", "office")
#: Standard deviations of the range (mm). Points are about 0.5 mm apart.
NOISES = (0.0, 0.01, 0.03, 0.1, 0.3)
#: Of the scanner in scenes, in units of its own: 1 mm and a tenth of a mm per metre.
FACTORS = (1.0, 3.0)
#: Draws of noise and viewpoints. The method is run on the first only: it takes most of the time.
RUNS = 3


def one(shape: str, noise: float, run: int, peers: bool = False) -> Draw:
    """What `Measured` says, of one draw; the method is asked in the first one only."""
    if shape in SCENES:
        scanset = mvreg.dataset(shape, run, noise=noise, mixed=0.0)
    else:
        scanset = mvreg.dataset(
            "figurine", shape=shape, noise=noise, quantisation=0.0, noise_rng=run
        )
    method, rng = mvreg.load_method(), np.random.default_rng(run)
    views = method.pipeline.prepare(scanset.scans, rng)
    truth, first = rebased(scanset.poses or {}, views), views[0].name
    start = Result(first, spoilt(truth, views, rng), (), ())
    found = JointRefinement()(start, views, method.pipeline)
    least = scatter(views, truth, least_of(shape, views, truth, noise)) if noise else 0.0
    error = displacement(views, truth, found.poses)
    reported = scatter(views, truth, found.covariances)
    composed = None if run else from_method(method, views, truth, rng)
    squared = [
        normalised(found.poses[v.name], truth[v.name], found.covariances[v.name]) for v in views[1:]
    ]
    others = [
        displacement(views, truth, refine(views, start.poses)) for refine in PEERS.values() if peers
    ]
    unit = 1e3 if shape in SCENES else 1.0  # metres there
    return Draw(
        unit * np.array([least, error, reported]), np.array(squared),
        None if composed is None else unit * composed, tuple(unit * each for each in others),
    )  # fmt: skip


def least_of(
    shape: str, views: Sequence[View], truth: Mapping[str, Array], noise: float
) -> dict[str, Array]:
    """The bound, with the noise of the shape's instrument."""
    if shape not in SCENES:
        return bound(views, truth, noise)
    error = PHASE_SCANNER
    return bound(views, truth, noise, lambda ranges: error.constant + error.linear * ranges)


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


def finished(cases: Sequence[tuple[str, float]], runs: int, drawer: Drawer) -> list[Measured]:
    """What the draws on disk come to, of the cases that have the first one."""
    found = []
    for case in cases:
        every = [drawer.kept(*case, run) for run in range(runs)]
        if every and every[0] is not None:
            found.append(summed_up(*case, [each for each in every if each is not None]))
    return found


def write(found: Sequence[Measured], results: Path) -> None:
    """The page and its figure."""
    if not found:
        raise SystemExit("bound: expected at least one finished draw, found none; run it first")
    head = HEAD.format(version=version("mvreg"), date=date.today())
    table = "\n".join(row(item) for item in found)
    results.mkdir(parents=True, exist_ok=True)
    shapes = [item for item in found if item.shape not in SCENES]
    picture = "\n![Error over noise](bound.png)\n" if shapes else ""
    (results / "bound.md").write_text(f"{head}{table}\n{picture}")
    if shapes:
        with styled():
            save(draw(pooled(shapes)), results / "bound.png", colours=64)
    print(table)


def main() -> None:
    """Measure, print and keep the table, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shapes", nargs="+", default=SHAPES + SCENES)
    parser.add_argument("--noises", nargs="+", type=float, default=NOISES)
    parser.add_argument("--factors", nargs="+", type=float, default=FACTORS)
    parser.add_argument("--peers", type=int, default=1)
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--kept", type=Path, default=Path("runs/bound") / versions()[:12])
    parser.add_argument("--written", action="store_true", help="only from what is finished")
    chosen = parser.parse_args()
    cases = [
        (shape, noise)
        for shape in chosen.shapes
        for noise in (chosen.factors if shape in SCENES else chosen.noises)
    ]
    drawer = Drawer(chosen.kept, one)
    if not chosen.written:  # one draw of every case before the next of any
        every = [(*case, run, run < chosen.peers) for run in range(chosen.runs) for case in cases]
        for each in track(every, description="bound"):
            drawer(*each)
    write(finished(cases, chosen.runs, drawer), chosen.results)


if __name__ == "__main__":
    main()
