"""A run made by hand at a far offset, for the tests of exports."""

import numpy as np

from mvreg.export.model import Model
from mvreg.export.placements import Component, Link, Placements
from mvreg.geometry import se3
from mvreg.types import Array, Scan, ScanSet

NAMES = ("a.ply", "b scan.ply", "c.pcd", "lost.ply")
#: Mean distance of the points, and where the model is: a hundredth of one must survive there.
SPACING, OFFSET = 0.02, 5_000_000.0


def poses(rng: np.random.Generator, offset: float = OFFSET) -> dict[str, Array]:
    """Poses far away, of all scans but the last; one turns by half a turn."""
    found = {name: se3.random(rng, shift=3.0) for name in NAMES[:-1]}
    found["c.pcd"][:3, :3] = np.diag([-1.0, -1.0, 1.0])
    for pose in found.values():
        pose[:3, 3] += [offset, -offset, offset / 10]
    return found


def component(rng: np.random.Generator, offset: float = OFFSET) -> Component:
    """The first component of a run, with two links."""
    links = (Link("b scan.ply", "a.ply", 0.99), Link("c.pcd", "b scan.ply", 0.75))
    return Component(1, "a.ply", poses(rng, offset), links)


def placed(one: Component) -> Placements:
    """The placements of a run with one component."""
    return Placements(NAMES, (one,), (NAMES[-1],), SPACING)


def scanset(rng: np.random.Generator, count: int = 400) -> ScanSet:
    """Scans of a wavy surface, with what scanners tell of points; the second lacks colours."""
    scans = []
    for number, name in enumerate(NAMES):
        side = int(count**0.5)
        x, y = np.meshgrid(np.arange(side) * SPACING, np.arange(side) * SPACING)
        points = np.column_stack([x.ravel(), y.ravel(), 0.1 * np.sin(9 * x.ravel())])
        points += rng.normal(scale=SPACING / 20, size=points.shape)
        attributes = {
            "intensity": rng.integers(0, 4000, len(points)).astype(np.uint16),
            "residual": rng.random(len(points)).astype(np.float32),
        }
        normals = rng.normal(size=(len(points), 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        attributes |= dict(zip(("nx", "ny", "nz"), normals.astype(np.float32).T, strict=True))
        if number != 1:
            for colour in ("red", "green", "blue"):
                attributes[colour] = rng.integers(0, 256, len(points)).astype(np.uint8)
        scans.append(Scan(name, points, attributes=attributes))
    return ScanSet("waves", tuple(scans))


def model(rng: np.random.Generator, offset: float = OFFSET) -> Model:
    """The scans and where they are."""
    one = component(rng, offset)
    return Model(scanset(rng), one, placed(one))


def expected(found: Model) -> Array:
    """The points of a model (N, 3), by the definition."""
    scans = {scan.name: scan for scan in found.scanset.scans}
    return np.concatenate([
        scans[name].points @ pose[:3, :3].T + pose[:3, 3]
        for name, pose in found.component.poses.items()
    ])  # fmt: skip
