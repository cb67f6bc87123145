"""Another data set degraded: noise, outliers, missing points, sparse scans."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mvreg.config.nested_dataset import load_named
from mvreg.datasets.base import ScanSource
from mvreg.errors import InputError
from mvreg.types import Array, Scan, ScanSet

#: The box that outliers fill is grown on each side by this share of the scan's largest side.
MARGIN = 0.1


@dataclass(frozen=True)
class Spoilt(ScanSource):
    """Another data set, made worse in ways that can be measured; the poses stay true.

    In this order: points are dropped, the rest get noise, outliers are added, and some scans are
    thinned with all that they have.

    Parameters
    ----------
    of : str
        The name of a data set or preset, parameters of its own may follow: ``bunny``,
        ``"mixture of=[bunny,dragon]"``; required.
    noise : float
        Standard deviation of Gaussian noise, in resolutions: the median over the scans of the
        mean distance of a point to the nearest other one, as the scans came. It is along the line
        of sight where the sensor is known, else in every direction.
    outliers : float
        Share of outliers among the points of the spoilt scan, 0 to less than 1; uniform in the
        scan's box, grown by a tenth on each side.
    drop : float
        Share of the points that are lost at random, 0 to less than 1.
    sparse : int
        How many scans, drawn at random, are thinned.
    thin : float
        These keep one point in so many, drawn at random.
    """

    of: str = ""
    noise: float = 0.0
    outliers: float = 0.0
    drop: float = 0.0
    sparse: int = 0
    thin: float = 10.0

    def __post_init__(self) -> None:
        super().__post_init__()
        checks = {
            "noise": (0 <= self.noise < np.inf, "0 or more"),
            "outliers": (0 <= self.outliers < 1, "from 0 to less than 1"),
            "drop": (0 <= self.drop < 1, "from 0 to less than 1"),
            "sparse": (self.sparse >= 0, "0 or more"),
            "thin": (1 <= self.thin < np.inf, "1 or more"),
        }
        for key, (valid, expected) in checks.items():
            if not valid:
                raise InputError(
                    f"dataset.{key}={getattr(self, key)}: expected a number, {expected}"
                )

    @property
    def name(self) -> str:
        """What a spoilt set is called before it is loaded."""
        return "spoilt"

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Load the other set, and spoil its scans.

        Raises
        ------
        InputError
            If it cannot be loaded, or has fewer scans than are to be thinned.
        """
        if not self.of:
            raise InputError("dataset=spoilt needs the data set to be spoilt: dataset.of=bunny")
        found = load_named("dataset.of", self.of, rng)
        total = len(found.scans)
        if self.sparse > total:
            raise InputError(
                f"dataset.sparse={self.sparse}: expected at most {total}, which is how many scans "
                f"{self.of!r} has"
            )
        deviation = self.noise * _resolution(found.scans)
        thinned = set(rng.choice(total, size=self.sparse, replace=False).tolist())
        scans = tuple(
            self._spoil(scan, deviation, index in thinned, rng)
            for index, scan in enumerate(found.scans)
        )
        return replace(found, name=f"{found.name}_spoilt", scans=scans)

    def _spoil(self, scan: Scan, deviation: float, thinned: bool, rng: np.random.Generator) -> Scan:
        """One scan, with noise of the standard deviation `deviation` (length)."""
        points = _drawn(scan.points, 1 - self.drop, rng)
        lower, upper = points.min(axis=0), points.max(axis=0)
        if deviation > 0:
            points = points + deviation * _errors(replace(scan, points=points, attributes={}), rng)
        if self.outliers > 0:
            count = round(len(points) * self.outliers / (1 - self.outliers))
            margin = MARGIN * (upper - lower).max()
            false = rng.uniform(lower - margin, upper + margin, size=(count, 3))
            # Anywhere in the list, as those of a sensor are, and not all at its end.
            points = np.insert(points, rng.integers(0, len(points) + 1, size=count), false, axis=0)
        if thinned:
            points = _drawn(points, 1 / self.thin, rng)
        return replace(scan, points=points, attributes={}, full=None)


def _resolution(scans: tuple[Scan, ...]) -> float:
    """The median over the scans of the mean distance to the nearest other point (length)."""
    from mvreg.geometry.nearest import mean_spacing

    return float(np.median([mean_spacing(scan.points) for scan in scans]))


def _drawn(points: Array, share: float, rng: np.random.Generator) -> Array:
    """A share of the points, at least one, drawn at random, in their order."""
    if share == 1:
        return points
    count = max(1, round(share * len(points)))
    chosen: Array = points[np.sort(rng.choice(len(points), size=count, replace=False))]
    return chosen


def _errors(scan: Scan, rng: np.random.Generator) -> Array:
    """Errors (N, 3) of unit standard deviation, along the line of sight where it is known."""
    if scan.view_direction is not None:
        return rng.standard_normal((len(scan.points), 1)) * scan.view_direction
    if scan.view_point is not None:
        rays = scan.points - scan.view_point
        lengths = np.linalg.norm(rays, axis=1, keepdims=True)
        errors: Array = rng.standard_normal(lengths.shape) * rays / np.maximum(lengths, 1e-300)
        return errors
    return rng.standard_normal(scan.points.shape)
