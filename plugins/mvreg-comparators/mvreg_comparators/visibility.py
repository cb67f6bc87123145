"""Surface consistency: what one scan saw must leave room for the other.

A sensor sees through free space up to the first surface. Where a registered scan has points in
front of the surface that another sensor saw, along its rays, one of the two is in the wrong place.
Points behind that surface are hidden from it and say nothing, and neither do points where the
sensor has no range at all. (Huber and Hebert 2003, "Fully automatic registration of multiple 3D
data sets", Image and Vision Computing 21; they learn the distributions of these measures and take
the likelihood ratio, here they have fixed limits.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.stages import ResidualJudge
from mvreg.surface import RangeImage, Sensor, underconstrained
from mvreg.types import Array, Registration, Verdict, View, ViewGraph

#: A view, and what its sensor saw; None where nothing is known of that.
Witness = tuple[View, RangeImage | None]
#: How many of a sensor's rays answer for a point, at most; the nearest ones.
RAYS = 4


@dataclass(frozen=True)
class Sight:
    """What one sensor makes of the points of another scan, as shares of these.

    `consistent` lie on the surface that it saw, `in_front` float in what it saw to be free,
    `behind` are hidden; the rest is where it saw nothing.
    """

    consistent: float
    in_front: float
    behind: float

    @property
    def violation(self) -> float:
        """Share of free-space violations in what can be told, 0 where nothing can."""
        told = self.in_front + self.consistent
        return self.in_front / told if told else 0.0


@dataclass(frozen=True)
class Visibility:
    """How free-space violations are found, and how many are too many.

    Parameters
    ----------
    reach : float
        Rays farther than this from a point do not answer for it, in resolutions of the
        down-sampled scans: about three spacings of the raw points.
    tolerance : float
        How far in front of, or behind, the surface a point may be and still lie on it, in
        resolutions.
    max_violation : float
        Largest share of violations. Of the raw pairs of the Bunny the right ones have at most 0.07,
        the wrong ones at least 0.22.
    sensor : Sensor
        What is done about scans that do not say where their sensor was.
    """

    reach: float = 1.0
    tolerance: float = 2.0
    max_violation: float = 0.1
    sensor: Sensor = Sensor.estimated

    def __post_init__(self) -> None:
        for name in ("reach", "tolerance"):
            if not 0 < getattr(self, name) < np.inf:
                raise InputError(f"{name}: expected a positive number, got {getattr(self, name)}")
        if not 0 <= self.max_violation <= 1:
            raise InputError(f"max_violation: expected a share in [0, 1], got {self.max_violation}")

    def image(self, view: View) -> RangeImage | None:
        """What the sensor of a view saw, None where nothing is known of it."""
        return RangeImage.of(view, self.sensor)

    def sight(self, image: RangeImage, points: Array, resolution: float) -> Sight:
        """Look at the points (N, 3) of another scan, in the frame of `image`."""
        height, low, high = image.nearby(points, self.reach * resolution, RAYS)
        # NaN, where there is no ray, is neither.
        front = height > high + self.tolerance * resolution
        behind = height < low - self.tolerance * resolution
        consistent = ~np.isnan(low) & ~front & ~behind
        return Sight(float(consistent.mean()), float(front.mean()), float(behind.mean()))

    def sights(
        self,
        source: Witness,
        target: Witness,
        T_target_source: Array,
    ) -> list[Sight]:
        """What each sees of the other: of two, one or none, as their sensors are known."""
        (moving, moving_image), (still, still_image) = source, target
        resolution = moving.scale.resolution
        found = []
        if still_image is not None:
            points = se3.apply(T_target_source, moving.points)
            found.append(self.sight(still_image, points, resolution))
        if moving_image is not None:
            points = se3.apply(se3.invert(T_target_source), still.points)
            found.append(self.sight(moving_image, points, resolution))
        return found


@dataclass(frozen=True)
class VisibilityJudge(Visibility, ResidualJudge):
    """Reliable if neither scan stands in what the other saw to be free space (Huber and Hebert).

    Both ways where the target is a scan. A merged model has no sensor: then only what the source's
    sensor makes of the model counts. Where nothing is known of either sensor nothing is reliable.

    Parameters
    ----------
    reach, tolerance, max_violation, sensor
        As in `Visibility`.
    min_visible : float
        Smallest share of points on the surface that the other scan saw, of the scan that has the
        more of them.
    min_overlap : float
        Registrations that keep less of the source are not relied on; 0 leaves it to the refinement.
    min_localizability : float
        Of the trimmed pairs, see `mvreg.stages.judge.PointToPlaneJudge`: a plane may slide along
        another without a violation.
    """

    min_visible: float = 0.2
    min_overlap: float = 0.0
    min_localizability: float = 0.003

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        graph: ViewGraph,
    ) -> Verdict:
        sights = self.sights(
            (source, self.image(source)),
            (target, self.image(target)),
            registration.T_target_source,
        )
        if not sights:
            return Verdict(False, 1.0, self.max_violation, "nothing is known of the sensors")
        violation = max(sight.violation for sight in sights)
        visible = max(sight.consistent for sight in sights)
        reason = "no surface stands in free space"
        if violation > self.max_violation:
            reason = "free-space violation: a surface lies where the other sensor saw free space"
        elif visible < self.min_visible:
            reason = "too little is seen by both"
        elif weak := underconstrained(
            registration, source, target, self.min_overlap, self.min_localizability
        ):
            reason = weak
        else:
            return Verdict(True, violation, self.max_violation, reason)
        return Verdict(False, violation, self.max_violation, reason)
