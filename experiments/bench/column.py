"""A tall column with surface relief, scanned along a helix: an object of arbitrary size.

    python -m experiments.bench.column FOLDER --views 300 --points 10000

keeps scans of it for the benchmarks, which then load them from files. A scan is the same however
many there are. It overlaps those of the turn that it is on, and of the turns above and below it:
a number that does not depend on the height of the column.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.bench.relief import RADIUS, relief
from mvreg.datasets.base import ScanSource
from mvreg.datasets.camera import RangeCamera
from mvreg.datasets.mesh import Mesh
from mvreg.datasets.viewpoints import orbit
from mvreg.types import Array, Scan, ScanSet

#: From the column's axis to the sensor (mm).
DISTANCE = 300.0
#: Degrees; what is seen of the column is about 95 mm high, and all of its near side.
FIELD_OF_VIEW = 20.0
#: From one view to the next: around the column (degrees) and upwards (mm).
TURN, CLIMB = 30.0, 4.5
#: Elevations of the sensor (degrees), one after another, over and over.
ELEVATIONS = (0.0, 14.0, 3.0, -12.0)
#: What is meshed above and below the middle of a view (mm); no ray meets the column farther off.
HALF = 150.0
#: Of the range (mm), as the figurine's.
NOISE, QUANTISATION = 0.08, 0.02


@dataclass(frozen=True)
class Column(ScanSource):
    """The first scans of the column, from a folder that `keep` has filled.

    Parameters
    ----------
    folder : str
        Where they are kept.
    views : int
        How many.
    """

    folder: str = ""
    views: int = 10

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Read the scans; `rng` is not used."""
        files = [Path(self.folder) / f"column_{index:03d}.npz" for index in range(self.views)]
        scans, poses = [], {}
        for file in files:
            with np.load(file) as kept:
                scans.append(Scan(file.stem, kept["points"], view_point=kept["view_point"]))
                poses[file.stem] = kept["pose"]
        return ScanSet("column", tuple(scans), "mm", poses)


def keep(folder: Path, views: int, points: int, step: float) -> None:
    """Scan the column, and keep each scan in a file; those that are there already stay.

    Parameters
    ----------
    folder : Path
    views : int
        Number of scans.
    points : int
        Points per scan, about.
    step : float
        Edges of the mesh (mm).
    """
    folder.mkdir(parents=True, exist_ok=True)
    for index in range(views):
        file = folder / f"column_{index:03d}.npz"
        if file.exists():
            continue
        scan, pose = one(index, points, step)
        unfinished = file.with_suffix(".part")
        with unfinished.open("wb") as stream:
            np.savez(stream, points=scan.points, view_point=scan.view_point, pose=pose)  # type: ignore[arg-type]
        unfinished.rename(file)


def one(index: int, points: int, step: float) -> tuple[Scan, Array]:
    """Scan number `index`, and its pose ``T_world_scan`` (4, 4)."""
    rng = np.random.default_rng([index, 0xC01])
    pose = viewpoint(index, rng)
    height = CLIMB * index
    camera = RangeCamera(
        points, field_of_view=FIELD_OF_VIEW, noise=NOISE, quantisation=QUANTISATION
    )
    # As with the figurine, a scan's origin is in what is measured and not at the sensor.
    standoff = np.eye(4)
    standoff[2, 3] = DISTANCE
    back = np.eye(4)
    back[2, 3] = -DISTANCE
    scan = camera(mesh(height - HALF, height + HALF, step), pose, rng)
    return scan.moved(standoff), pose @ back


def viewpoint(index: int, rng: np.random.Generator) -> Array:
    """The pose ``T_world_scan`` (4, 4) of a sensor held by hand, on the helix or near it."""
    wobble = rng.uniform(-1, 1, size=5) * [4, 4, 12, 0.06, 3]
    middle = np.array([0.0, 0.0, CLIMB * index + wobble[4]])
    elevation = ELEVATIONS[index % len(ELEVATIONS)] + wobble[1]
    return orbit(middle, DISTANCE * (1 + wobble[3]), index * TURN + wobble[0], elevation, wobble[2])


def mesh(bottom: float, top: float, step: float) -> Mesh:
    """The column between two heights (mm), open at its ends; a part of one grid for all heights."""
    around = round(2 * np.pi * RADIUS / step)
    angle = 2 * np.pi * np.arange(around) / around
    height = step * np.arange(np.floor(bottom / step), np.ceil(top / step) + 1)
    axis = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(around)])
    smooth = (RADIUS * axis + np.multiply.outer(height, [0.0, 0.0, 1.0])[:, None]).reshape(-1, 3)
    vertices = smooth + relief(smooth)[:, None] * np.tile(axis, (len(height), 1))
    a = (around * np.arange(len(height) - 1)[:, None] + np.arange(around)).ravel()
    b = (around * np.arange(len(height) - 1)[:, None] + np.roll(np.arange(around), -1)).ravel()
    triangles = np.vstack([np.column_stack([a, b, b + around]),
                           np.column_stack([a, b + around, a + around])])  # fmt: skip
    return Mesh(vertices, triangles)


def main() -> None:
    """Keep the scans that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--views", type=int, default=10)
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--step", type=float, default=1.0, help="edges of the mesh (mm)")
    chosen = parser.parse_args()
    keep(chosen.folder, chosen.views, chosen.points, chosen.step)


if __name__ == "__main__":
    main()
