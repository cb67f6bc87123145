"""A small run made by hand, for the tests of what observes runs."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from mvreg import events
from mvreg.geometry import se3
from mvreg.report.build import build_report
from mvreg.types import (
    Answer,
    Array,
    Candidates,
    Features,
    Link,
    Matches,
    Model,
    Pair,
    Part,
    Registration,
    Result,
    Scale,
    Scan,
    ScanSet,
    Verdict,
    View,
)

TRUTH = {
    "a.ply": np.eye(4),
    "b.ply": se3.from_parts(np.eye(3), np.array([2.0, 0, 0])),
    "c.ply": np.eye(4),
}


def plate(shift: float) -> Array:
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0))
    return np.column_stack([x.ravel() - shift, y.ravel(), 0.01 * np.sin(x).ravel()])


def view_of(scan: Scan, keypoints: int = 30) -> View:
    normals = np.tile([0.0, 0, 1], (len(scan.points), 1))
    features = Features(
        scan.points[:keypoints],
        np.tile([0.0, 0, 1], (keypoints, 1, 1)),
        np.zeros((keypoints, 9)),
        True,
    )
    return View(scan.name, scan.points, normals, features, 1.0, Scale(5.0, 1.0))


def scanset(truth: bool = True, unit: str = "mm") -> ScanSet:
    scans = tuple(
        Scan(name, plate(shift)) for name, shift in [("a.ply", 0), ("b.ply", 2), ("c.ply", 900)]
    )
    return ScanSet("plates", scans, unit, TRUTH if truth else None)


def registration(source: str, shift: float = 2.0) -> Registration:
    pose = se3.from_parts(np.eye(3), np.array([shift, 0, 0]))
    pairs = np.zeros((5, 2), dtype=np.intp)
    return Registration(source, "a.ply", pose, 0.8, 0.25, 0.5, pairs, np.zeros(5), 1.0, 7, True)


def accepted(source: str, found: Registration) -> Pair:
    return Pair(
        source,
        "a.ply",
        Verdict(True, 0.25, 2.0, "trimmed MSE within Eq. (7)"),
        found.T_target_source,
        found.overlap,
        found.trimmed_mse,
        {"seed": 0.25, "refine": 0.5},
    )


def rejected(source: str, found: Registration) -> Pair:
    return Pair(
        source,
        "a.ply",
        Verdict(False, 4.0, 2.0, "trimmed MSE above Eq. (7)"),
        found.T_target_source,
        0.4,
        4.0,
        {"seed": 0.25},
    )


def hopeless(source: str) -> Pair:
    return Pair(source, "a.ply", Verdict(False, float("inf"), 0.0, "no candidate pose"))


def run(folder: Path | None = None, truth: bool = True, unit: str = "mm") -> list[events.Event]:
    """Three scans: a reference, one that is placed, and one that fails twice, without keypoints."""
    data = scanset(truth, unit)
    views = [view_of(scan) for scan in data.scans[:2]] + [view_of(data.scans[2], keypoints=0)]
    a, b, c = views
    model = Model.of(a)
    good, bad = registration("b.ply"), registration("c.ply", 5.0)
    grown = Model(
        "a.ply",
        np.concatenate([a.points, b.points + np.array([2.0, 0, 0])]),
        np.concatenate([a.normals, b.normals]),
        a.features,
        1.0,
        a.scale,
        parts=(Part(a, np.eye(4)), Part(b, good.T_target_source)),
    )
    pairs = (hopeless("c.ply"), accepted("b.ply", good), rejected("c.ply", bad))
    seeds = Matches(np.column_stack([np.arange(25), np.arange(25)]), np.zeros(25))
    candidates = Candidates(good.T_target_source[None], np.zeros(1), (seeds.indices[:12],))
    none = Matches(np.empty((0, 2), dtype=np.intp), np.empty(0))
    poses = {"a.ply": np.eye(4), "b.ply": good.T_target_source}
    result = Result("a.ply", poses, ("c.ply",), pairs, grown)
    report = build_report(
        data, views, result, method="grow", rng=3, seconds={"load": 0.5, "total": 1.5},
        config={"seed": {"top_fraction": 0.3}},
    )  # fmt: skip
    return [
        events.RunStarted(data, "grow", folder),
        *(events.ViewPrepared(view, k, 3) for k, view in enumerate(views)),
        events.ReferenceChosen(model),
        events.PairStarted(c, model),
        events.PairRegistered(c, model, none, Candidates.none(), None, pairs[0]),
        events.PairStarted(b, model),
        events.PairRegistered(b, model, seeds, candidates, good, pairs[1]),
        events.ViewPlaced("b.ply", good.T_target_source, grown, 0.125),
        events.PairStarted(c, grown),
        events.PairRegistered(c, grown, none, Candidates.none(), bad, pairs[2]),
        events.AdjustStarted(result),
        events.RunFinished(data, result, report),
    ]


def apart(truth: bool = True) -> list[events.Event]:
    """Six scans: two in the reference's model, two in another, one ambiguous, one left over.

    They are plates that lie on each other, which any pose along the plate would do for.
    """
    names = ("a.ply", "b.ply", "d.ply", "e.ply", "s.ply", "x.ply")
    shifts = {"b.ply": 2.0, "e.ply": 3.0}
    scans = tuple(Scan(name, plate(shifts.get(name, 0.0))) for name in names)
    poses = {
        name: se3.from_parts(np.eye(3), np.array([shifts.get(name, 0.0), 0, 0])) for name in names
    }
    # The truth has the second pair elsewhere, and e half a unit off.
    known = {**poses, "e.ply": se3.from_parts(np.eye(3), np.array([3.5, 0, 0]))}
    data = ScanSet("plates", scans, "mm", known if truth else None, remarks=("left one out",))
    views = [view_of(scan) for scan in scans]
    first = {name: poses[name] for name in names[:2]}
    second = {name: poses[name] for name in names[2:4]}
    turned = np.diag([-1.0, -1.0, 1.0, 1.0])
    symmetric = attempt("s.ply", "a.ply", False, "ambiguous: another pose is as probable", 0.8)
    answers = Answer(np.eye(4), 0.5), Answer(turned, 0.4, 7.0)
    pairs = (
        attempt("b.ply", "a.ply", True, "surfaces agree", 0.98),
        attempt("e.ply", "d.ply", True, "surfaces agree", 0.97),
        attempt("e.ply", "a.ply", False, "too little overlap", 0.4),
        replace(symmetric, answers=answers),
        attempt("x.ply", "d.ply", True, "surfaces agree", 0.91),
    )
    links = (Link("a.ply", "b.ply", 300, 0.3), Link("b.ply", "a.ply", 100, 0.1))
    result = Result(
        "a.ply", first, ("s.ply", "x.ply"), pairs, components=(second,), links=links,
        covariances={"b.ply": np.diag([1e-6, 0, 0, 0.01, 0, 0])},
    )  # fmt: skip
    about = {"method": "auto", "rng": 3, "seconds": {"load": 0.5, "total": 1.5}, "config": {}}
    return [
        events.RunStarted(data, "auto"),
        *(events.ViewPrepared(view, k, len(views)) for k, view in enumerate(views)),
        events.ReferenceChosen(Model.of(views[2])),
        events.PosesRevised("d.ply", second, ()),
        events.PosesRevised("a.ply", first, (second,)),
        events.AdjustStarted(result),
        events.RunFinished(data, result, build_report(data, views, result, **about)),
    ]


def attempt(source: str, target: str, reliable: bool, reason: str, confidence: float) -> Pair:
    """A pair as a judge that knows a confidence leaves it."""
    evidence = {"surface_overlap": 1 / 3, "residual": 2.0}
    verdict = Verdict(reliable, 1 - confidence, 0.1, reason, confidence, evidence)
    return Pair(source, target, verdict, np.eye(4), 0.5, 0.25, {"judge": 0.5})
