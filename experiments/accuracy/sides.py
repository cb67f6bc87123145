"""By how much the two sides of something thin differ, and two scans of one side.

    python -m experiments.accuracy.sides --draws 4

Scissors in code, 1.5 to 3 mm thick, look from behind as turned over. The default method registers
twelve scans of each pair, moved at random, no sensor told, and a line says how far surfaces in
contact differ beyond their noise (RMS, resolutions): the most of right poses that it found, the
least of plausible wrong ones, and where scans were placed. What `EXCESS` in
``mvreg/stages/strategy/best_first/other_side.py`` was chosen by.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

import mvreg
from experiments.accuracy.placements import Tolerance, Truth, judged
from mvreg.datasets.base import Order, ScanSource
from mvreg.datasets.camera import RangeCamera
from mvreg.datasets.mesh import Mesh
from mvreg.datasets.sdf import Array as Floats
from mvreg.datasets.sdf import Part
from mvreg.datasets.surfacenets import surface_net
from mvreg.datasets.viewpoints import orbit
from mvreg.evidence.pooled import ViewPair, pool_evidence
from mvreg.stages.strategy.best_first.other_side import beyond_noise
from mvreg.types import Array, Result, Scan, ScanSet

#: A wrong pose counts if it is so plausible by itself.
PLAUSIBLE = 0.5
#: Blades and handles lie on one another: corners (mm) of the one in front, mirrored for the other.
BLADE = ((-4, -5), (6, -8), (3, 60), (0.5, 85), (-3, 30))
HANDLE = ((-2, -4), (5, -6), (16, -40), (10, -40))


def prism(corners: Array, thickness: float, z: float) -> Part:
    """What is above a polygon (N, 2), about the height `z`."""
    sides = np.roll(corners, -1, axis=0) - corners
    middle = (corners.max(axis=0) + corners.min(axis=0)) / 2

    def distance(points: Floats) -> Floats:
        away = points[:, None, :2] - corners
        share = np.clip((away * sides).sum(axis=-1) / (sides**2).sum(axis=-1), 0, 1)
        beside = np.linalg.norm(away - share[..., None] * sides, axis=-1).min(axis=1)
        above, left = away[..., 1] >= 0, away[..., 1] < sides[:, 1]
        turn = sides[:, 0] * away[..., 1] - sides[:, 1] * away[..., 0]
        crossed = (above & left & (turn > 0)) | (~above & ~left & (turn < 0))
        outside = np.where(crossed.sum(axis=1) % 2, -beside, beside)
        found: Floats = np.maximum(outside, np.abs(points[:, 2] - z) - thickness / 2)
        return found

    reach = float(np.linalg.norm(corners - middle, axis=1).max()) + thickness
    return Part(distance, np.array([*middle, z]), reach, blend=0.3)


def ring(centre: float, radius: float, thickness: float, z: float) -> Part:
    """A round bow for the fingers."""

    def distance(points: Floats) -> Floats:
        round_about = np.hypot(points[:, 0] - centre, (points[:, 1] + 55) * 0.8)
        found: Floats = np.hypot(np.abs(round_about - radius), points[:, 2] - z) - 1.1 * thickness
        return found

    return Part(distance, np.array([centre, -55, z]), 1.4 * radius + 2 * thickness, blend=0.3)


@lru_cache(maxsize=4)
def scissors(thickness: float, variant: int) -> Mesh:
    """Scissors, their blades in the plane z = 0; one bow is somewhat wider."""
    rng = np.random.default_rng([variant, 0x5C155])
    radius, wider, z = rng.uniform(12, 15), rng.uniform(0, 4), thickness / 2
    parts = []
    for corners in (BLADE, HANDLE):
        for side in (1, -1):
            parts.append(prism(np.array(corners) * [side, 1], thickness, side * z))
    parts += [ring(18, radius, thickness, z), ring(-18, radius + wider, thickness, -z)]
    return Mesh(*surface_net(parts, step=0.6))


@dataclass(frozen=True)
class Scissors(ScanSource):
    """Half of the scans are of the front, half of the back."""

    thickness: float = 2.0
    variant: int = 0
    scans: int = 12
    points: int = 4_000
    noise: float = 0.05
    name: str = "scissors"

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Scan them from all around, by a range camera."""
        mesh = scissors(self.thickness, self.variant)
        camera = RangeCamera(self.points, noise=self.noise)
        scans, poses = list[Scan](), dict[str, Array]()
        for k in range(self.scans):
            name = f"{'front' if 2 * k < self.scans else 'back'}_{k:02d}"
            lift = (60, 40, 75)[k % 3] * (1 if name[0] == "f" else -1)
            around, roll = 720 / self.scans * k + rng.uniform(-5, 5), rng.uniform(-12, 12)
            poses[name] = orbit(mesh.centre, 450.0, around, lift, roll)
            scans.append(camera(mesh, poses[name], rng, name))
        return ScanSet(self.name, tuple(scans), "mm", poses)


def excess(found: Result, truth: Truth, scans: ScanSet, tolerance: Tolerance) -> list[list[float]]:
    """How far surfaces differ beyond their noise (RMS, resolutions): right pairs, wrong pairs."""
    views = {view.name: view for view in found.views}
    said: list[list[float]] = [[], []]
    for pair in found.pairs:
        if pair.T_target_source is None:
            continue
        one = ViewPair(views[pair.source], views[pair.target], pair.T_target_source)
        evidence = pool_evidence([one])
        if evidence.plausibility < PLAUSIBLE:
            continue
        two = scans.as_read({pair.target: np.eye(4), pair.source: pair.T_target_source})
        right = truth.fits(pair.target, pair.source, two, tolerance)
        said[not right].append(beyond_noise(evidence))
    return said


def counted(found: Result, truth: Truth, scans: ScanSet, tolerance: Tolerance) -> Array:
    """How many scans were placed right, and how many falsely."""
    models = [one for one in (found.poses, *found.components) if len(one) > 1]
    each = [judged(scans.as_read(model), truth, tolerance) for model in models]
    return np.array([sum(len(one[k]) for one in each) for k in (0, 1)])


def line(thickness: float, draws: Sequence[int]) -> str:
    """What scissors of a thickness say."""
    beyond: list[list[float]] = [[], []]
    placed, total = np.zeros(2, dtype=int), 0
    for draw in draws:
        source = Scissors(
            order=Order.shuffle, scramble=True, sensor="unknown", thickness=thickness, variant=draw
        )
        scans = source(np.random.default_rng(draw))
        found = mvreg.register(scans, rng=draw)
        assert scans.poses is not None
        truth = Truth(scans.as_read(scans.poses), dict.fromkeys(scans.poses, ""))
        tolerance = Tolerance(2.0, 3 * found.views[0].scale.resolution)
        for kept, new in zip(beyond, excess(found, truth, scans, tolerance), strict=True):
            kept += new
        placed += counted(found, truth, scans, tolerance)
        total += len(scans.scans)
    most, least = max(beyond[0], default=0.0), min(beyond[1], default=np.inf)
    return (
        f"{thickness:4.1f} mm: right poses differ by {most:.2f} at most, wrong ones by {least:.2f} "
        f"at least; of {total} scans {placed[0]} placed, {placed[1]} falsely"
    )


def main() -> None:
    """Print a line for each thickness."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=4)
    asked = parser.parse_args()
    for thickness in (1.5, 2.0, 3.0):
        print(line(thickness, range(asked.draws)), flush=True)


if __name__ == "__main__":
    main()
