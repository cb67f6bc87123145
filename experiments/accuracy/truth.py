"""The truth behind a run, and the run judged by it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

import mvreg
from experiments.accuracy.placements import Placements, Poses, Tolerance, Truth, placements
from experiments.common.runs import Run
from mvreg.errors import InputError

Report = Mapping[str, Any]
#: A pose's error (degrees) as the run told it and as it is found now differ by less than this.
SAME = 1e-5


def placements_of(run: Run) -> Placements | None:
    """Scans of a run, correct, false or not placed; None without a result or a truth.

    Raises
    ------
    InputError
        If the scans, which are loaded where the result does not hold the truth, are not on this
        machine, or are no longer those of the run.
    """
    if run.report is None:
        return None
    truth = truth_of(run.report, run.value("dataset", run.report["dataset"]))
    if truth is None:
        return None
    models = models_of(run.report)
    return placements(models, run.report["unregistered"], truth, Tolerance.of(run.report))


def models_of(report: Report) -> list[Poses]:
    """The partial models of a run, the reference's first."""
    found = [report["poses"], *(each["poses"] for each in report.get("components", []))]
    return [as_read(poses, report) for poses in found]


def as_read(poses: Mapping[str, Any], report: Report) -> Poses:
    """Poses of scans in the frames that they were read in, before the run moved them."""
    motions = report.get("motions", {})
    return {
        name: np.array(pose) @ np.array(motions.get(name, np.eye(4)))
        for name, pose in poses.items()
    }


def truth_of(report: Report, dataset: str) -> Truth | None:
    """The truth behind a run: what its result holds, else what the data set says when loaded again.

    Parameters
    ----------
    report : mapping
        ``result.json``.
    dataset : str
        The data set's name on the command line.
    """
    if "truth" in report:
        poses, objects = report["truth"], report.get("objects")
    else:
        poses, objects = loaded(dataset, report["rng"], json.dumps(report["config"]["dataset"]))
    if poses is None:
        return None
    arrays = as_read(poses, report)
    truth = Truth(arrays, objects or dict.fromkeys(arrays, ""))
    check(report, truth)
    return truth


@cache
def loaded(dataset: str, rng: int, config: str) -> tuple[Poses | None, Mapping[str, str] | None]:
    """The true poses of a data set, and what its scans show; `config` is its parameters as JSON."""
    given = {key: value for key, value in json.loads(config).items() if key != "name"}
    scans = mvreg.dataset(dataset, rng=rng, **given)
    return scans.poses, scans.objects


def check(report: Report, truth: Truth) -> None:
    """Refuse a truth that is not that of the run: it would find every pose wrong, or right.

    Raises
    ------
    InputError
        If a pose's error is another than the run has told.
    """
    errors = report.get("errors")
    if not errors:
        return
    model, frame = models_of(report)[0], errors["frame"]
    for name, error in errors["scans"].items():
        if name in truth.poses and truth.objects[name] == truth.objects[frame]:
            angle, _ = truth.offset(frame, name, model)
            if abs(angle - error["angle_deg"]) > SAME:
                raise InputError(
                    f"the truth of {name!r} is not what it was when these scans were run "
                    f"({angle:g} degrees off, not {error['angle_deg']:g}); run them again with "
                    "resume=false"
                )
