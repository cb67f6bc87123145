"""The dual criterion of SpanT: the registrations of two scans, there and back, must agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.stages import ResidualJudge, TrimmedICP
from mvreg.surface import length_read_as_one
from mvreg.types import Array, Registration, Verdict, View, ViewGraph


@dataclass(frozen=True)
class DualCriterion:
    """How well two registrations, there and back, must fit and agree.

    1. TMSE there < `first_factor` m;
    2. the motions are each other's inverse: they differ by less than `max_rotation` and by less
       than `motion_factor` m;
    3. TMSE there or back < `either_factor` m.

    The lab's published code compares squared lengths with the length m, which depends on the unit;
    here numbers are read in the unit that makes the resolution `reference_resolution`, as Eq. (7)
    is in `judge=tmse`. It compares the motions' translations, which depend on where a scan's origin
    is, and adds up the differences of the rotations' entries, which depends on its axes; here the
    shift is that of the scan's centre, and the turn is an angle.

    Parameters
    ----------
    first_factor, either_factor, motion_factor : float
        2.8, 1.5 and 2.0 in the published code.
    max_rotation : float
        In degrees. The published code's sum of 0.1 is 1.7 degrees, on the mean over all axes.
    reference_resolution : float
        That of the Bunny in millimetres, at one point in ten.
    """

    first_factor: float = 2.8
    either_factor: float = 1.5
    motion_factor: float = 2.0
    max_rotation: float = 1.7
    reference_resolution: float = 1.4

    def __post_init__(self) -> None:
        names = ("first_factor", "either_factor", "motion_factor", "max_rotation")
        for name in (*names, "reference_resolution"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name}: expected a positive number, got {getattr(self, name)}")

    def unit(self, view: View) -> float:
        """The length that is read as 1."""
        return length_read_as_one(view, self.reference_resolution)

    def fits(self, there: Registration, source: View, level: float) -> bool:
        """Criterion (1), for m = `level` (length)."""
        return there.trimmed_mse < self.first_factor * level * self.unit(source)

    def agree(self, there: Registration, back: Registration, source: View, level: float) -> bool:
        """Criteria (2) and (3), for m = `level` (length); `there` moves `source`."""
        shift, turn = disagreement(there, back, source)
        smaller = min(there.trimmed_mse, back.trimmed_mse)
        return (
            shift < self.motion_factor * level
            and turn < self.max_rotation
            and smaller < self.either_factor * level * self.unit(source)
        )


def disagreement(there: Registration, back: Registration, source: View) -> tuple[float, float]:
    """By how much `back` fails to undo `there`: the shift of the source's centre, and degrees."""
    centre: Array = source.points.mean(axis=0)
    there_pose, back_pose = there.T_target_source, se3.invert(back.T_target_source)
    shift = np.linalg.norm(se3.apply(there_pose, centre) - se3.apply(back_pose, centre))
    return float(shift), float(np.rad2deg(se3.rotation_angle(there_pose, back_pose)))


@dataclass(frozen=True)
class DualJudge(DualCriterion, ResidualJudge):
    """Reliable if it fits, and refining the way back undoes it: SpanT's criterion for one pose.

    A judge cannot search for a pose: the way back begins at the inverse of the registration, so
    this is the weaker test of the two. m is the mean TMSE of the registrations accepted so far, at
    first the target's resolution.

    Parameters
    ----------
    first_factor, either_factor, motion_factor, max_rotation, reference_resolution
        As in `DualCriterion`.
    back_overlap : float
        Smallest overlap considered on the way back; a merged model is much larger than a scan.
    min_overlap : float
        Registrations that keep less of the source are not relied on; 0 leaves it to the refinement.
    """

    back_overlap: float = 0.1
    min_overlap: float = 0.0

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        graph: ViewGraph,
    ) -> Verdict:
        unit = self.unit(source)
        level = target.resolution
        if len(graph):
            level = float(np.mean([edge.trimmed_mse for edge in graph])) / unit
        threshold = self.first_factor * level * unit
        score = registration.trimmed_mse
        if not self.fits(registration, source, level):
            return Verdict(False, score, threshold, "trimmed MSE too large")
        if registration.overlap < self.min_overlap:
            return Verdict(False, score, threshold, f"overlap below {self.min_overlap:g}")
        way_back = TrimmedICP(min_overlap=self.back_overlap)
        back = way_back(target, source, se3.invert(registration.T_target_source))
        if not self.agree(registration, back, source, level):
            return Verdict(False, score, threshold, "the way back does not undo it")
        return Verdict(True, score, threshold, "fits there and back")
