"""Count scans placed correctly, placed wrongly (false positives) and not placed, by ground truth.

    python -m experiments.accuracy.placements runs/experiments/orders/*

It needs nothing of mvreg to judge: poses and truth are compared here, by themselves. A pose means
something only beside others in the same frame, so a partial model (the reference's, or one of the
other components) is judged as a whole:

- The scans that stand right to each other are found: same object, and a relative pose within the
  tolerance, all beside one scan of theirs. The largest such group is what the model shows.
- The group's scans are placed **correctly**; every other scan of the model is a **false
  positive**, be it of another object or in a wrong pose. Where no two scans stand right to each
  other, all are false: so any wrong relative pose within one model counts.
- A scan alone in its frame stands beside nothing: it is **not placed**, as are those left over.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mvreg.types import Array

#: A scan is placed right within so many degrees and so many mm of the truth.
ANGLE, SHIFT_MM = 2.0, 5.0
#: Where the unit of length is not known, and where it is the metre, which says that the scans are
#: of places and not of things: so many resolutions instead of the mm. The mm are about as many on
#: the Stanford sets.
SHIFT_RESOLUTIONS = 3.0
#: How many units of length a mm is.
UNITS = {"mm": 1.0, "cm": 0.1}

Poses = Mapping[str, Array]


@dataclass(frozen=True)
class Tolerance:
    """How far a pose may be from the truth: `angle` (degrees) and `shift` (length)."""

    angle: float
    shift: float

    @classmethod
    def of(cls, report: Mapping[str, Any]) -> Tolerance:
        """That of a run: 5 mm, or 3 resolutions where the unit is not known or the metre."""
        unit = UNITS.get(report["unit"])
        return cls(ANGLE, unit * SHIFT_MM if unit else SHIFT_RESOLUTIONS * report["resolution"])


@dataclass(frozen=True, eq=False)
class Truth:
    """Where the scans are: `poses` ``T_world_scan`` (4, 4), and which `objects` they show.

    Every object has a world of its own.
    """

    poses: Poses
    objects: Mapping[str, str]

    def offset(self, first: str, second: str, model: Poses) -> tuple[float, float]:
        """How far the second scan is from where it should be, seen from the first.

        Returns
        -------
        angle : float
            In degrees; infinite for a scan of another object.
        shift : float
            Length; infinite for a scan of another object.
        """
        if self.objects[first] != self.objects[second]:
            return np.inf, np.inf
        found = np.linalg.inv(model[first]) @ model[second]
        right = np.linalg.inv(self.poses[first]) @ self.poses[second]
        turn = (found[:3, :3] - right[:3, :3]) / np.sqrt(8)
        angle = 2 * np.degrees(np.arcsin(min(1.0, float(np.linalg.norm(turn)))))
        return float(angle), float(np.linalg.norm(found[:3, 3] - right[:3, 3]))

    def fits(self, first: str, second: str, model: Poses, tolerance: Tolerance) -> bool:
        """Whether the second scan is where it should be, seen from the first."""
        angle, shift = self.offset(first, second, model)
        return angle <= tolerance.angle and shift <= tolerance.shift


@dataclass(frozen=True)
class Misplaced:
    """A false positive beside other scans: how far off (degrees, length), or of what object."""

    scan: str
    beside: str
    angle: float
    shift: float

    def __str__(self) -> str:
        if not np.isfinite(self.angle):
            return f"{self.scan}, of another object than {self.beside} beside it"
        return (
            f"{self.scan}, {self.angle:.1f} degrees and {self.shift:.3g} off beside {self.beside}"
        )


@dataclass(frozen=True)
class Placements:
    """The scans of a run: placed `right`, `false`, or `left` without a place.

    `unknown` are those placed beside no other scan of which the truth is known as theirs is.
    """

    right: tuple[str, ...]
    false: tuple[Misplaced, ...]
    left: tuple[str, ...]
    unknown: tuple[str, ...] = ()

    @property
    def total(self) -> int:
        """How many scans there are."""
        return len(self.right) + len(self.false) + len(self.left) + len(self.unknown)


def placements(
    models: Sequence[Poses], unregistered: Sequence[str], truth: Truth, tolerance: Tolerance
) -> Placements:
    """Judge partial models.

    Parameters
    ----------
    models : sequence of mapping of scan name to (4, 4) array
        Each in a frame of its own, the reference's first.
    unregistered : sequence of str
        The scans in none of them.
    truth : Truth
    tolerance : Tolerance
    """
    right: list[str] = []
    false: list[Misplaced] = []
    left, unknown = list(unregistered), []
    for model in models:
        if len(model) < 2:
            left += model
            continue
        known = {name: T for name, T in model.items() if name in truth.poses}
        if len(known) < 2:
            known = {}
        unknown += [name for name in model if name not in known]
        good, bad = judged(known, truth, tolerance)
        right += good
        false += bad
    return Placements(tuple(right), tuple(false), tuple(left), tuple(unknown))


def judged(model: Poses, truth: Truth, tolerance: Tolerance) -> tuple[list[str], list[Misplaced]]:
    """The scans of one model that are right, and those that are false."""
    groups = {
        first: [second for second in model if truth.fits(first, second, model, tolerance)]
        for first in model
    }
    if not groups:
        return [], []
    # Of groups of one size the first: the reference is the first of its model.
    anchor = max(groups, key=lambda name: len(groups[name]))
    good = groups[anchor] if len(groups[anchor]) > 1 else []
    other = next(name for name in model if name != anchor)
    bad = []
    for name in model:
        if name not in good:
            beside = other if name == anchor else anchor
            bad.append(Misplaced(name, beside, *truth.offset(beside, name, model)))
    return good, bad


def main(folders: Sequence[str]) -> None:
    """Print how many scans each run placed how, and which are false positives or not placed."""
    from pathlib import Path

    from experiments.accuracy.truth import placements_of
    from experiments.common.runs import read

    for folder in folders:
        run = read(Path(folder))
        found = placements_of(run)
        if found is None:
            print(f"{folder}: {run.error or 'no truth is known'}")
            continue
        counts = len(found.right), len(found.false), len(found.left)
        print(f"{folder}: {counts[0]} correct, {counts[1]} false positives, {counts[2]} not placed")
        for each in found.false:
            print(f"  false positive: {each}")
        if found.left:
            print(f"  not: {', '.join(found.left)}")


if __name__ == "__main__":
    main(sys.argv[1:])
