"""Correct and wrong poses between all pairs of scans of one or two data sets, for calibration.

Every pair is registered as the default method does. Its best pose and the alternatives, all refined
on all the points, are kept; what the symmetries of the best pose allow; and right poses that were
made to slide along the surface, the way it holds them least, as they are and refined again. A pose
is right within 2 degrees and 5 mm of the truth, or 3 resolutions where lengths are in metres, if by
the truth a twentieth of the source or of the target lies on the other: scans of different objects
have none.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.progress import track

from experiments.calibration.raw_pairs import LEAST
from experiments.calibration.scenes import Scene, pairs_of, scene
from mvreg.geometry import se3
from mvreg.geometry.nearest import nearest
from mvreg.stages.strategy.best_first.symmetry import symmetry_hypotheses
from mvreg.surface.displacement import rms_apart
from mvreg.types import Array, Registration, View, ViewGraph

#: What is right: degrees, mm, resolutions of scans in metres.
ANGLE, SHIFT, SHIFT_IN_RESOLUTIONS = 2.0, 5.0, 3.0
#: A pose that is off by less than so many times what is right is neither right nor wrong.
NEARLY = 1.5
#: Poses that differ by less are one: the angle above, resolutions.
SAME = 3.0
#: Slides of right poses: root mean square of the points' motion, resolutions.
SLIDES = (4.0, 8.0, 20.0)


@dataclass(frozen=True)
class Pose:
    """A pose and what is known of it.

    `kind` is "best", "alternative", "symmetry", "slide", "slid" or "truth"; `angle` (degrees) and
    `shift` (of the middle of the source, length) are the error, None without truth; `true_overlap`
    is the larger of both scans'.
    """

    source: str
    target: str
    kind: str
    pose: list[list[float]]
    true_overlap: float
    angle: float | None
    shift: float | None
    right: bool

    @property
    def matrix(self) -> Array:
        """``T_target_source`` (4, 4)."""
        return np.array(self.pose)


def find(group: str, blind: bool) -> list[Pose]:
    """Register all pairs of a group, and keep right and wrong poses."""
    found = scene(group, "estimated" if blind else "known")
    pairs = pairs_of(found, group)
    rngs = np.random.default_rng(0).spawn(len(pairs))
    kept: list[Pose] = []
    for (a, b), rng in track(list(zip(pairs, rngs, strict=True)), description=group):
        source, target = found.views[a], found.views[b]
        registration, _ = found.pipeline.register(source, target, ViewGraph(), rng)
        if registration is not None:
            kept += poses_of(found, registration, rng)
    return kept


def with_truth(found: Scene, poses: Sequence[Pose]) -> list[Pose]:
    """The poses, less slides that are still right and what is nearly right, and more right ones.

    Where the search missed the right one although the scans overlap, what the truth is refined to.
    """
    kept = [
        pose for pose in poses
        if not (nearly(found, pose) or (pose.kind in ("slide", "slid") and pose.right))
    ]  # fmt: skip
    placed = {(pose.source, pose.target) for pose in kept if pose.right}
    missed = {(p.source, p.target) for p in kept if p.true_overlap >= LEAST} - placed
    for a, b in sorted(missed):
        source, target = found.views[a], found.views[b]
        truth = found.relative(a, b)
        assert truth is not None
        refined = found.pipeline.refine(source, target, truth).T_target_source
        kept.append(compare(found, source, target, "truth", refined))
    return kept


def poses_of(found: Scene, registration: Registration, rng: np.random.Generator) -> list[Pose]:
    """The best pose of a registration, its alternatives, and slides of it if it is right."""
    source, target = found.views[registration.source], found.views[registration.target]
    best = registration.T_target_source
    refine = found.pipeline.refine
    starts = [("alternative", pose) for pose in registration.alternatives]
    starts += [
        ("symmetry", pose) for pose in symmetry_hypotheses(registration, source, target, refine)
    ]
    rows = [compare(found, source, target, "best", best)]
    if rows[0].right:
        for length in SLIDES:
            slid = slide(source, target, best, length * source.scale.resolution, rng)
            rows.append(compare(found, source, target, "slide", slid))
            starts.append(("slid", slid))
    kept = [best]
    for kind, start in starts:
        refined = refine(source, target, start).T_target_source
        if not any(same(source, refined, other) for other in kept):
            kept.append(refined)
            rows.append(compare(found, source, target, kind, refined))
    return rows


def same(source: View, first: Array, second: Array) -> bool:
    """Whether two poses of a source are one."""
    if np.rad2deg(se3.rotation_angle(first, second)) > ANGLE:
        return False
    return rms_apart(source.points, first, second) <= SAME * source.scale.resolution


def slide(
    source: View, target: View, pose: Array, length: float, rng: np.random.Generator
) -> Array:
    """The pose, moved by `length` (RMS over the overlap) the way that changes the fit least.

    One of the three weakest directions of point-to-plane distances, drawn at random.
    """
    moved = se3.apply(pose, source.points)
    distances, partners = nearest(target.tree, moved, 2 * source.scale.resolution)
    met = np.isfinite(distances)
    centre = moved[met].mean(axis=0)
    offsets, normals = moved[met] - centre, target.normals[partners[met]]
    radius = float(np.sqrt((offsets**2).sum(axis=1).mean()))
    jacobian = np.hstack([np.cross(offsets / radius, normals), normals])
    _, vectors = np.linalg.eigh(jacobian.T @ jacobian)
    twist = vectors[:, int(rng.integers(3))] * np.repeat([1 / radius, 1.0], 3)
    motion = np.cross(twist[:3], offsets) + twist[3:]
    twist *= length / np.sqrt((motion**2).sum(axis=1).mean())
    return se3.about(centre, se3.exp(twist)) @ pose


def compare(found: Scene, source: View, target: View, kind: str, pose: Array) -> Pose:
    """Compare a pose with the truth."""
    truth = found.relative(source.name, target.name)
    rows = pose.tolist()
    if truth is None:
        return Pose(source.name, target.name, kind, rows, 0.0, None, None, right=False)
    overlap = found.true_overlap(source.name, target.name)
    angle = float(np.degrees(se3.rotation_angle(truth, pose)))
    middle = source.points.mean(axis=0)[None]
    shift = float(np.linalg.norm(se3.apply(pose, middle) - se3.apply(truth, middle)))
    right = overlap >= LEAST and angle < ANGLE and shift < allowed(found)
    return Pose(source.name, target.name, kind, rows, overlap, angle, shift, right)


def allowed(found: Scene) -> float:
    """The largest shift of a right pose (length)."""
    scale = next(iter(found.views.values())).scale
    return SHIFT_IN_RESOLUTIONS * scale.resolution if found.unit == "m" else SHIFT


def nearly(found: Scene, pose: Pose) -> bool:
    """Whether a pose that is not right is off by little more than those that are."""
    if pose.right or pose.angle is None or pose.shift is None or pose.true_overlap < LEAST:
        return False
    return pose.angle < NEARLY * ANGLE and pose.shift < NEARLY * allowed(found)


def cached(group: str, blind: bool, folder: Path) -> Sequence[Pose]:
    """The poses of a group, from its file where it is, else found now."""
    file = folder / f"{group}{'-blind' if blind else ''}.json"
    if not file.is_file():
        file.parent.mkdir(parents=True, exist_ok=True)
        rows = [asdict(pose) for pose in find(group, blind)]
        unfinished = file.with_suffix(".part")
        unfinished.write_text(json.dumps({"poses": rows}, allow_nan=False), "utf-8")
        unfinished.replace(file)
    return [Pose(**row) for row in json.loads(file.read_text("utf-8"))["poses"]]
