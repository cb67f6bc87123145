"""Calibrate the judge by evidence: fit its probability, and evaluate how well it discriminates.

    python -m experiments.calibration.calibrate

registers the pairs of all sets, or of those groups that are given, and scans of different objects
with each other, which takes hours; what is found is kept in ``runs/experiments/evidence/``, so that
it goes on where it stopped. Weighs every pose, right or wrong, with what the scans say of their
sensors and without, and fits the weights that `mvreg.evidence.calibration` holds; they are
printed, to be copied there. Weights of the sensors' kind "none" are of all poses weighed without
sensors. Writes ``experiments/results/evidence.md``, ``evidence_roc.png`` and
``reliability.png``, in which every pose's probability is by weights fitted to other kinds of
scene only.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.calibration.fit import Flags, Sample, cross_validated, fit, kind, predict
from experiments.calibration.page import line, write
from experiments.calibration.rows import Row, rows_of
from experiments.common.runs import ROOT
from experiments.common.style import save, styled
from mvreg.evidence.calibration import CENTRE, FEATURES, WEIGHTS
from mvreg.evidence.pooled import LEAST_LOCALIZABILITY, LEAST_PLAUSIBILITY, LEAST_POINTS
from mvreg.stages.judge.evidence import EvidenceJudge
from mvreg.types import Array

RESULTS = Path(__file__).parents[1] / "results"
FOLDER = ROOT / "evidence"
#: Groups of poses: scans of one set, with noise, of two different sets.
GROUPS = (
    "bunny", "dragon", "buddha", "armadillo", "armadillo_virtual", "figurine", "blob-1", "blob-2",
    "bunny~noise", "figurine~noise", "bunny+dragon", "dragon+buddha", "figurine+bunny",
    "room-0", "room-1", "room-2", "office-0", "office-1", "tls_office", "street-0", "street-1",
    "lidar_campus", "desk-0", "desk-1", "rgbd_desk",
    "room-1+room-2", "street-0+street-1", "office-0+room-0",
)  # fmt: skip
#: What is known of the sensors: the key of the weights, and the features that do not count.
SETTINGS: Mapping[str, tuple[int, ...]] = {
    "known": (),
    "estimated": (),
    "none": (FEATURES.index("violation"),),
}


@dataclass(frozen=True, eq=False)
class Judged:
    """The poses of a group (P,): which are `right`, and their cross-validated `chances`.

    `best` are the best poses of attempts; None if all are.
    """

    right: Flags
    chances: Array
    best: Flags | None = None


def localizable(row: Row) -> bool:
    """Whether the overlap cannot slide along itself."""
    return row.localizability >= LEAST_LOCALIZABILITY


def sample(rows: Sequence[Row], kind: str = "", *, sliding: bool = True) -> Sample:
    """The poses under which scans meet; those that can slide only if asked for."""
    chosen = [row for row in rows if row.points >= LEAST_POINTS and (sliding or localizable(row))]
    features = np.array([row.features for row in chosen]).reshape(-1, len(FEATURES))
    return Sample(features, np.array([row.right for row in chosen], dtype=bool), kind)


def in_use(groups: Mapping[str, Sequence[Row]], setting: str) -> dict[str, Judged]:
    """Probabilities by the weights that `mvreg.evidence.calibration` holds."""
    weights, centre = np.array(WEIGHTS[setting]), np.array(CENTRE)
    return {
        name: judged(rows, predict(weights, sample(rows).features, centre))
        for name, rows in groups.items()
    }


def judged(rows: Sequence[Row], chances: Array) -> Judged:
    """Poses with the `chances` of those under which scans meet; 0 where ambiguous."""
    every = np.zeros(len(rows))
    every[[row.points >= LEAST_POINTS for row in rows]] = chances
    slides = ~np.array([localizable(row) for row in rows], dtype=bool)
    every[slides & (every > LEAST_PLAUSIBILITY)] = 0.0
    right, best = ([row.right for row in rows], [row.kind == "best" for row in rows])
    return Judged(np.array(right, dtype=bool), every, np.array(best, dtype=bool))


def judge(groups: Mapping[str, Sequence[Row]], without: Sequence[int]) -> dict[str, Judged]:
    """Cross-validated probabilities of all poses of all groups, 0 where ambiguous."""
    learnt = {name: sample(rows, kind(name), sliding=False) for name, rows in groups.items()}
    asked = {name: sample(rows).features for name, rows in groups.items()}
    chances = cross_validated(learnt, asked, np.array(CENTRE), without)
    return {name: judged(groups[name], some) for name, some in chances.items()}


def by_kind(judged: Mapping[str, Judged]) -> dict[str, Judged]:
    """The poses of all groups of a kind together."""
    together: dict[str, list[Judged]] = {}
    for name, one in judged.items():
        together.setdefault(kind(name), []).append(one)
    return {
        name: Judged(
            np.concatenate([one.right for one in some]),
            np.concatenate([one.chances for one in some]),
        )
        for name, some in together.items()
    }


def weighed(group: str, setting: str) -> list[Row]:
    """The rows of a group; "estimated" leaves out pairs of which no sensor could be told."""
    rows = rows_of(group, setting, FOLDER)
    return [row for row in rows if setting == "none" or row.sensor == setting]


def main(names: Sequence[str]) -> None:
    """Measure what has not been, fit, print the weights, write the page and the figures."""
    from experiments.calibration.figures import draw_reliability, draw_roc

    threshold = EvidenceJudge().min_probability
    parts: tuple[list[str], ...] = ([], [], [])
    found, weights = {}, []
    for setting, without in SETTINGS.items():
        groups = {group: weighed(group, setting) for group in names}
        groups = {group: rows for group, rows in groups.items() if rows}
        found[setting] = judge(groups, without)
        used = in_use(groups, setting)
        for part, some in zip(parts, (by_kind(found[setting]), found[setting], used), strict=True):
            part += [line(setting, *item, threshold) for item in some.items()]
        samples = [sample(rows, kind(name), sliding=False) for name, rows in groups.items()]
        fitted = fit(samples, np.array(CENTRE), without)
        weights.append(f'    "{setting}": ({", ".join(f"{weight:.2f}" for weight in fitted)}),')
    write(RESULTS / "evidence.md", parts, threshold)
    with styled():
        save(draw_roc(found), RESULTS / "evidence_roc.png", 64)
        save(draw_reliability(found), RESULTS / "reliability.png", 64)
    print("\n".join([*parts[2], "", "WEIGHTS = {", *weights, "}"]))


if __name__ == "__main__":
    main(sys.argv[1:] or GROUPS)
