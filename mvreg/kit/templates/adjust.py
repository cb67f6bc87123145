"""All poses improved at once, after the loop: ``adjust=nameless``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.errors import check_positive
from mvreg.geometry import Array, se3
from mvreg.types import Result, View


@dataclass(frozen=True)
class NamelessAdjust:
    """Refine every scan in turn to all the others together, and them to it: halfway between.

    Each scan is refined to where the others are by then. The two ways err to opposite sides where
    the points of one are denser than the other's.

    Parameters
    ----------
    sweeps : int
        How often each has its turn.
    fewest : int
        Scans with fewer points stay where they are.
    """

    sweeps: int = 2
    fewest: int = 50

    def __post_init__(self) -> None:
        check_positive("adjust", sweeps=self.sweeps)

    def __call__(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        """Improve poses by the refinement of the `pipeline`.

        Returns
        -------
        Result
            With the same scans in the same places; the pose of each model's first scan stays.
        """
        known = {view.name: view for view in views}
        return replace(
            result,
            poses=self.improved(result.poses, result.reference, known, pipeline),
            components=tuple(
                self.improved(poses, next(iter(poses)), known, pipeline)
                for poses in result.components
            ),
            model=None, covariances={}, links=(),
        )  # fmt: skip

    def improved(
        self, poses: Mapping[str, Array], first: str, known: Mapping[str, View], pipeline: Pipeline
    ) -> dict[str, Array]:
        """The poses (4, 4) of one model, that of its `first` scan as it was."""
        found = dict(poses)
        for _ in range(self.sweeps):
            for name in list(found):
                if name == first or len(known[name].points) < self.fewest:
                    continue
                others = [(known[other], pose) for other, pose in found.items() if other != name]
                target = together([each for each in others if len(each[0].points)])
                if len(target.points) >= self.fewest:
                    found[name] = halfway(known[name], target, found[name], pipeline)
        return found


def halfway(view: View, others: View, pose: Array, pipeline: Pipeline) -> Array:
    """The mean of two poses (4, 4): of the view refined to the others, and the others to it."""
    there = pipeline.refine(view, others, pose).T_target_source
    back = pipeline.refine(others, view, se3.invert(pose)).T_target_source
    between = se3.log(se3.invert(there) @ se3.invert(back))
    found: Array = there @ se3.exp(between / 2)
    return found


def together(placed: Sequence[tuple[View, Array]]) -> View:
    """One view of all points of views, each moved by its pose (4, 4)."""
    if not placed:
        raise AssertionError("a model has a first scan")
    first = placed[0][0]
    points = np.concatenate([se3.apply(pose, view.points) for view, pose in placed])
    normals = np.concatenate([view.normals @ pose[:3, :3].T for view, pose in placed])
    return View("the others", points, normals, first.features, first.resolution, first.scale)
