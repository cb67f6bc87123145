"""Joint refinement: all poses at once, each surface against every surface in contact with it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.errors import InputError
from mvreg.stages.adjust.components import over_components
from mvreg.stages.adjust.joint.ending import Settled
from mvreg.stages.adjust.joint.scales import MOST, REFINEMENTS, RESTED, smaller, told
from mvreg.stages.adjust.joint.solver import Solver
from mvreg.stages.adjust.joint.surface import surfaces
from mvreg.surface.consistency import fit_score
from mvreg.types import Array, Result, View

#: The surfaces may measure worse by this share before the poses found are thrown away: so much
#: does the measure itself differ between poses a hundredth of a resolution apart.
SLACK = 0.01


@dataclass(frozen=True, eq=False)
class Refinement:
    """The refinement of one partial model, as a task; parameters as of `JointRefinement.refined`.

    Its answer is that of `refined`.
    """

    kinds: ClassVar[tuple[str, ...]] = ()
    answers: ClassVar[tuple[type, ...]] = (Settled,)

    members: tuple[int, ...] = field(metadata={"stored": False})
    stage: JointRefinement
    poses: Mapping[str, Array]
    fixed: tuple[str, ...]

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline
    ) -> tuple[Mapping[str, Array], Settled | None]:
        return self.stage.refined(self.poses, self.fixed, views)


@dataclass(frozen=True)
class JointRefinement:
    """Refine all poses at once, so that every surface lies on every other one that it touches.

    Point to plane (Chen and Medioni 1992) over all overlapping pairs of scans at once (Pulli 1999;
    Neugebauer 1997, who also solves for all poses in one system): samples of each scan, smoothed
    over the raw points about them, are to lie on the curved patches of every other scan. Robust
    (Tukey's biweight, Beaton and Tukey 1974), with a kernel that shrinks with the residuals'
    spread; Gauss-Newton on SE(3) with sparse normal equations, the gauge fixed at the reference.
    First on few samples and on planes, from far off; then on all, each weighted by the noise that
    its scan has there, which is told by how the points scatter about their surface, and by what
    scans get wrong together at an incidence, told by how far their surfaces are apart. Where it
    ends does not depend on where it starts: from three degrees off on real scans it is the same to
    0.01 resolutions.

    Scans that no chain of overlaps joins to the reference keep their poses, and partial models are
    refined each by itself. The result has covariances and links; the scan that fixes the gauge has
    a covariance of zero, and one that nothing holds has none.

    Parameters
    ----------
    reach : float
        At first surfaces attract each other over so many resolutions. Three degrees turn the ends
        of the Bunny's scans by about three.
    kernel : float
        Width of the kernel, in standard deviations of the residuals: what is farther off counts for
        nothing. On Gaussian residuals this width has 95 per cent of the efficiency of least squares
        (Holland and Welsch 1977).
    max_rounds : int
        Most rounds of finding contacts and solving, in each of the two phases; five are usual.
    guarded : bool
        Keep the poses as they were where the surfaces meet less in the end, see
        `mvreg.surface.consistency.fit_score`.
    scale : bool
        Estimate the scale of each scan, too, about the middle of its points: `Result.scales`. Poses
        are then those of the scans made larger by that factor, whose geometric mean is one, since
        nothing tells it; several scans that are `fixed` do, by their distances. What the surfaces
        do not tell stays one. Off, since rooms whose scans have the right scale are placed a third
        worse with it.
    """

    reach: float = 4.0
    kernel: float = 4.685
    max_rounds: int = 30
    guarded: bool = True
    scale: bool = False
    holds_fixed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        for key in ("reach", "kernel"):
            if not getattr(self, key) > 0:
                raise InputError(
                    f"adjust.{key}: expected a number above 0, got {getattr(self, key)}"
                )
        if self.max_rounds < 0:
            raise InputError(f"adjust.max_rounds: expected 0 or more, got {self.max_rounds}")

    def __call__(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        return over_components(result, lambda part: self.improved(part, views, pipeline))

    def improved(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        """Refine one partial model with its reference fixed; itself where that fails."""
        fixed = {v.name for v in views if v.scan is not None and v.scan.fixed}
        held = fixed & result.poses.keys() or {result.reference}
        members = tuple(k for k, view in enumerate(views) if view.name in result.poses)
        task = Refinement(members, self, result.poses, tuple(sorted(held)))
        ((poses, settled),) = pipeline.perform([task], views)
        if settled is None:
            return result
        return replace(
            result, poses=poses, covariances=settled.covariances, links=settled.links,
            scatter=(settled.scatter,), patterns=settled.patterns, scales=settled.scales,
            model=None,
        )  # fmt: skip

    def refined(
        self, poses: Mapping[str, Array], fixed: Collection[str], views: Sequence[View]
    ) -> tuple[Mapping[str, Array], Settled | None]:
        """Poses refined with those of the scans `fixed` held; None where that fails."""
        placed = [view for view in views if view.name in poses and len(view.points)]
        names = [view.name for view in placed]
        if len(placed) < 2 or not set(fixed) & set(names) or not placed[0].scale.resolution > 0:
            return poses, None
        held = frozenset(names.index(name) for name in fixed if name in names)
        settled, seen = self._settled([poses[name] for name in names], held, placed)
        if settled is None:
            return poses, None
        found = {name: settled.poses.get(name, pose) for name, pose in poses.items()}
        if self.guarded and fit_score(found, seen) < (1 - SLACK) * fit_score(poses, placed):
            return poses, None
        return found, settled

    def _settled(
        self, motions: Sequence[Array], held: frozenset[int], placed: Sequence[View]
    ) -> tuple[Settled | None, Sequence[View]]:
        """Where the refinement comes to rest; and the views, in the scales that it has found."""
        if self.scale and len(placed) > MOST:
            raise InputError(
                f"adjust.scale: expected a model of at most {MOST} scans, got {len(placed)}; "
                "leave it off, or register the scans in parts"
            )
        names, given = tuple(view.name for view in placed), np.zeros(len(placed))
        for _ in range(REFINEMENTS if self.scale else 1):
            seen = [smaller(view, one) for view, one in zip(placed, given.tolist(), strict=True)]
            settled = Solver(
                surfaces(seen), names, held, placed[0].scale.resolution, self.reach, self.kernel,
                self.max_rounds, given if self.scale else None,
            ).settle(motions)  # fmt: skip
            if settled is None or settled.oversize is None:
                break
            left = settled.oversize
            settled = replace(settled, scales=told(names, given, left), oversize=None)
            if (np.abs(left.steps) <= RESTED * left.deviations).all():
                break
            motions = [settled.poses.get(n, p) for n, p in zip(names, motions, strict=True)]
            given = given + left.steps
        return settled, seen
