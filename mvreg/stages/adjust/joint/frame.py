"""The frame of the unknowns of a joint refinement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.geometry import se3
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.types import Array


@dataclass(frozen=True)
class Frame:
    """Coordinates of order one for the unknowns: `centre` (3,) and `radius` (length) of a model."""

    centre: Array
    radius: float

    @classmethod
    def of(cls, surfaces: Sequence[Surface], motions: Array) -> Frame:
        """The frame about all the samples of placed surfaces."""
        counts = np.array([len(s.points) for s in surfaces])
        placed = zip(surfaces, motions, strict=True)
        middles = np.stack([se3.apply(motion, s.moments[0]) for s, motion in placed])
        centre = counts @ middles / counts.sum()
        apart = counts @ ((middles - centre) ** 2).sum(axis=1)
        total = apart + sum(s.moments[1] for s in surfaces)
        return cls(centre, float(np.sqrt(total / counts.sum())) or 1.0)

    def motion(self, unknowns: Array) -> Array:
        """The motions (..., 4, 4) of unknowns (..., 6)."""
        steps = se3.exp(unknowns * np.array([1.0, 1, 1, *3 * [self.radius]]))
        return np.stack([se3.about(self.centre, step) for step in steps])

    @property
    def twists(self) -> Array:
        """(6, 6): twists about the model frame's origin, from the unknowns."""
        change = np.eye(6)
        change[3:, :3] = se3.skew(self.centre)
        change[3:, 3:] *= self.radius
        return change
