"""Returns that stand still in the sensor's frame: what came from nowhere, at the largest range.

Some sensors write a pixel without a return as one at their largest range. These points lie on a
sphere about the sensor, whatever it looks at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.geometry.arrays import Flags
from mvreg.surface.sensor import sensor_of
from mvreg.types import Array, Scan
from mvreg.types.lazy import kept_on_argument

#: The shell: so large a share of its radius from the sphere. Of a tilting laser all are within
#: 0.0002. The layer below it, which is to be all but empty, is so many times as thick, and all that
#: is farther away than its lower side counts for the sphere at first.
SHELL, BELOW = 0.001, 50
#: The shell has so many times the points of the layer below and of all above: of that laser 106
#: times and more; the outermost shell of other scans 0.3, or up to 4 by 8 points and fewer.
CROWDED = 10.0
#: And at least so many points.
FEWEST = 50
#: It is no wall far away: its points are so many shells off the plane that fits them best (RMS).
CURVED = 3.0
#: How far the sphere's centre may be from an estimated position (radii).
OFF = 0.1
#: So many scans are named in a remark.
NAMED = 5
#: Fits of the sphere, each to what is near the one before.
FITS = 8


@dataclass(frozen=True, eq=False)
class Sphere:
    """A centre (3,) and a radius (length)."""

    centre: Array
    radius: float

    def heights(self, points: Array) -> Array:
        """How far points (N, 3) are outside of it, in radii (N,)."""
        away: Array = np.linalg.norm(points - self.centre, axis=1)
        return away / self.radius - 1


@kept_on_argument
def at_largest_range(scan: Scan) -> Flags:
    """Which points (N,) of a scan are no returns, but stand at the largest range of its sensor.

    Where the sensor's position is told, or else estimated, and a thin shell of the very farthest
    points holds far more of them than the layer below it. The estimate may be off: the sphere is
    fitted to the farthest points. None are, where all rays are parallel or the sensor is unknown.
    """
    none = np.zeros(len(scan.points), dtype=bool)
    if len(scan.points) < FEWEST:
        return none
    sensor = sensor_of(scan)
    if sensor is None or sensor.point is None:
        return none
    sphere = _outermost(scan.points, sensor.point, fitted=not scan.knows_sensor)
    if sphere is None:
        return none
    heights = sphere.heights(scan.points)
    shell: Flags = np.abs(heights) <= SHELL
    others = int((heights > -BELOW * SHELL).sum() - shell.sum())
    count = int(shell.sum())
    if count < max(FEWEST, CROWDED * others) or _is_flat(scan.points[shell], sphere.radius):
        return none
    return none if shell.all() else shell


def without_largest_range(scan: Scan) -> Scan:
    """The scan without these points; the same one if there are none."""
    shell = at_largest_range(scan)
    return scan.chosen(~shell) if shell.any() else scan


def remark_on_largest_range(scans: Sequence[Scan]) -> tuple[str, ...]:
    """What is said of the points left out of each scan: one sentence, or nothing."""
    counts = {scan.name: int(at_largest_range(scan).sum()) for scan in scans}
    where = [name for name, count in counts.items() if count]
    if not where:
        return ()
    named = ", ".join(where[:NAMED]) + (f" and {len(where) - NAMED} more" * (len(where) > NAMED))
    return (
        f"left {sum(counts.values()):,} points out of registration that are all at the largest "
        f"range of the sensor, where nothing came back, in {len(where)} of {len(counts)} scans "
        f"({named}); the model has them",
    )


def _outermost(points: Array, position: Array, fitted: bool) -> Sphere | None:
    """The sphere about the sensor that the farthest points lie on; None where none is near."""
    sphere = Sphere(position, float(np.linalg.norm(points - position, axis=1).max()))
    if not sphere.radius > 0:
        return None
    if not fitted:
        return sphere
    reach = BELOW * SHELL
    for _ in range(FITS):
        near = points[np.abs(sphere.heights(points)) <= reach]
        if len(near) < FEWEST:
            return None
        sphere = _fitted(near, sphere)
        if not np.linalg.norm(sphere.centre - position) <= OFF * sphere.radius:
            return None
        reach = max(reach / 2, SHELL)
    return sphere


def _fitted(points: Array, before: Sphere) -> Sphere:
    """A sphere through points (N, 3), with weights that fade where another one is far off.

    The least squares of ``|p|^2 = 2 c p + (r^2 - |c|^2)``, about the centre of the one before.
    """
    away = points - before.centre
    heights = before.heights(points)
    scale = float(np.median(np.abs(heights - np.median(heights)))) + SHELL / 10
    weights = 1 / (1 + ((heights - np.median(heights)) / (2 * scale)) ** 2)
    rows = np.column_stack([2 * away, np.full(len(away), before.radius)])
    right = (away**2).sum(axis=1)
    found = np.linalg.lstsq(rows * weights[:, None], right * weights, rcond=None)[0]
    squared = before.radius * found[3] + found[:3] @ found[:3]
    return Sphere(before.centre + found[:3], float(np.sqrt(max(squared, 1e-300))))


def _is_flat(points: Array, radius: float) -> bool:
    """Whether points (N, 3) are as near to a plane as to a sphere of that radius."""
    centred = points - points.mean(axis=0)
    least = float(np.linalg.eigvalsh(centred.T @ centred / len(points))[0])
    return float(np.sqrt(max(least, 0.0))) < CURVED * SHELL * radius
