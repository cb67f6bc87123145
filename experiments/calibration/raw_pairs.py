"""Register every ordered pair of raw scans, and see which are right.

A registration is right if its rotation is within 5 degrees of the truth and the middle of the
source within 5 resolutions of where the truth has it. Where, by the truth, less than a twentieth of
the source lies on the target's surface, none can be relied on: whatever comes out counts as wrong.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import permutations
from pathlib import Path

import numpy as np
from rich.progress import track

import mvreg
from mvreg.geometry import se3
from mvreg.geometry.nearest import nearest
from mvreg.report.upgrade import renamed
from mvreg.stages.judge.residual import TmseJudge
from mvreg.surface.fit import localizability, surface_fit
from mvreg.types import Array, Registration, View, ViewGraph

#: What is right: degrees, resolutions.
ANGLE, SHIFT = 5.0, 5.0
#: Overlap by the truth: points nearer than this (resolutions) count, and at least this share.
NEAR, LEAST = 2.0, 0.05


@dataclass(frozen=True)
class RawPair:
    """One registration, in resolutions of the down-sampled scans.

    `true_overlap` is the share of the source's points on the target's surface by the truth; `angle`
    (degrees) and `shift` are the error, and `right` follows from these. The rest a judge can see:
    the trimmed MSE, over the first threshold of Eq. (7), 2 d_Q, and by itself; and what
    `mvreg.stages.judge` calls `surface_fit`, overlap and `localizability`.
    """

    source: str
    target: str
    true_overlap: float
    angle: float
    shift: float
    right: bool
    tmse_ratio: float
    trimmed_mse: float
    residual: float
    agreement: float
    overlap: float
    localizability: float


def register_all(name: str) -> list[RawPair]:
    """All ordered pairs of a data set for which FCPMA's stages find a pose.

    Raises
    ------
    InputError
        If the data set has no ground truth, or is not on this machine.
    """
    scanset = mvreg.dataset(name)
    if scanset.poses is None:
        raise mvreg.InputError(f"{name} has no ground truth; registrations cannot be told right")
    pipeline = mvreg.load_method("fcpma").pipeline
    rng = np.random.default_rng(0)
    views = pipeline.prepare(scanset.scans, rng)
    found = []
    pairs = list(permutations(views, 2))
    for (source, target), own in track(
        list(zip(pairs, rng.spawn(len(pairs)), strict=True)), description=name
    ):
        registration, _ = pipeline.register(source, target, ViewGraph(), own)
        if registration is not None:
            truth = se3.invert(scanset.poses[target.name]) @ scanset.poses[source.name]
            found.append(measure(registration, source, target, truth))
    return found


def measure(registration: Registration, source: View, target: View, truth: Array) -> RawPair:
    """Compare a registration with the truth ``T_target_source`` (4, 4), and measure it."""
    unit = source.scale.resolution
    overlap = true_overlap(source, target, truth)
    angle = float(np.degrees(se3.rotation_angle(truth, registration.T_target_source)))
    middle = source.points.mean(axis=0)[None]
    apart = se3.apply(registration.T_target_source, middle) - se3.apply(truth, middle)
    shift = float(np.linalg.norm(apart)) / unit
    verdict = TmseJudge()(registration, source, target, ViewGraph())
    residual, agreement = surface_fit(registration, source, target)
    return RawPair(
        source.name, target.name, overlap, angle, shift,
        right=overlap >= LEAST and angle < ANGLE and shift < SHIFT,
        tmse_ratio=verdict.score / verdict.threshold,
        trimmed_mse=registration.trimmed_mse / unit**2,
        residual=residual, agreement=agreement, overlap=registration.overlap,
        localizability=localizability(registration, source, target),
    )  # fmt: skip


def true_overlap(source: View, target: View, truth: Array) -> float:
    """Share of the source's points that the truth puts onto the target, facing the same way."""
    moved = se3.apply(truth, source.points)
    distances, partners = nearest(target.tree, moved, NEAR * source.scale.resolution)
    met = np.isfinite(distances)
    cosines = (source.normals[met] @ truth[:3, :3].T * target.normals[partners[met]]).sum(axis=1)
    if not (source.features.oriented and target.features.oriented):
        cosines = np.abs(cosines)
    return float((cosines > 0.7).sum() / len(moved))


def load(file: Path) -> list[RawPair]:
    """Read pairs back."""
    kept = json.loads(file.read_text("utf-8"))["pairs"]
    return [RawPair(**renamed(row, {"stability": "localizability"})) for row in kept]


def save(pairs: Sequence[RawPair], file: Path) -> None:
    """Keep pairs; the file is whole or not there."""
    file.parent.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_suffix(".part")
    rows = [asdict(pair) for pair in pairs]
    unfinished.write_text(json.dumps({"pairs": rows}, indent=1, allow_nan=False), "utf-8")
    unfinished.replace(file)


def cached(names: Sequence[str], folder: Path) -> Iterator[tuple[str, list[RawPair]]]:
    """The pairs of each data set, from ``folder/NAME.json`` where it is, else registered now."""
    for name in names:
        file = folder / f"{name}.json"
        if not file.is_file():
            save(register_all(name), file)
        yield name, load(file)
