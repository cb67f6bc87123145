"""Motion averaging: absolute poses by least squares from redundant relative motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.stages.adjust import view_graph
from mvreg.stages.adjust.components import over_components
from mvreg.stages.adjust.dense import dense
from mvreg.surface.consistency import fit_score
from mvreg.surface.displacement import STILL, farthest
from mvreg.types import Array, Edge, Result, View
from mvreg.types.view_graph import reachable

#: Newton steps of one average; three or four are usual, each squares the error.
STEPS = 20
#: Steps shorter than this (radians, and lengths relative to the motions' own) are rounding.
ROUNDING = 1e-12


def average(
    motions: Array, edges: Sequence[Edge], weights: Array, reference: int
) -> tuple[Array, set[int]]:
    """Least-squares absolute poses from weighted relative motions.

    Lie-algebraic averaging (Govindu 2004; Govindu and Pooja, TIP 2014). An edge that is satisfied
    has ``M_i M_ij = M_j``. Each step takes what is left, ``v = log(M_i M_ij M_j^-1)``, solves
    ``x_j - x_i = v`` over all edges for the corrections x, and moves ``M_j <- exp(x_j) M_j``.

    Parameters
    ----------
    motions : (N, 4, 4) array
        ``T_model_scan`` to start from.
    edges : sequence of Edge
        Relative motions between positions in `motions`.
    weights : (E,) array
        Positive; how much each edge counts.
    reference : int
        The pose that stays.

    Returns
    -------
    motions : (N, 4, 4) array
        Poses without a path of edges to the reference are as they were.
    moved : set of int
        Those that have such a path, without the reference.
    """
    moved = reachable(((e.target, e.source) for e in edges), reference) - {reference}
    used = [k for k, edge in enumerate(edges) if edge.target in moved or edge.source in moved]
    if not used:
        return motions, set()
    motions = motions.copy()
    tails = np.array([edges[k].target for k in used])
    heads = np.array([edges[k].source for k in used])
    relative = np.stack([edges[k].T_target_source for k in used])
    root = np.sqrt(weights[used])[:, None]
    free = np.array(sorted(moved))
    system = root * _incidence(tails, heads, free)
    for _ in range(STEPS):
        left = se3.log(motions[tails] @ relative @ se3.invert(motions[heads]))
        step = np.asarray(np.linalg.lstsq(system, root * left, rcond=None)[0], dtype=np.float64)
        motions[free] = se3.exp(step) @ motions[free]
        size = np.abs(left[:, 3:]).max() + np.abs(motions[:, :3, 3]).max()
        if np.abs(step[:, :3]).max() < ROUNDING and np.abs(step[:, 3:]).max() <= ROUNDING * size:
            break
    for k in free:
        motions[k] = se3.project(motions[k])
    return motions, moved


def _incidence(tails: Array, heads: Array, free: Array) -> Array:
    """(E, F) matrix of ``x_head - x_tail`` over the `free` poses; the others' x are zero."""
    matrix: Array = (heads[:, None] == free).astype(float) - (tails[:, None] == free)
    return matrix


@dataclass(frozen=True)
class MotionAveraging:
    """Re-register all overlapping pairs of views, and average the relative motions on SE(3).

    After Govindu and Pooja (TIP 2014), with trimmed pairs as Li and Zhu (3DV 2014, MATrICP):
    the pairs of placed views that overlap are refined from the current poses, by the pipeline's
    own refinement; the poses of all but the reference follow from the relative motions by least
    squares; and so on until they stand still. Errors of a long chain of scans are thus spread
    over every loop that the views close. Scans that no chain of overlaps joins to the reference
    keep their poses; without any overlap the result stays as it is.

    Parameters
    ----------
    min_overlap : float
        Pairs that share more than this, see `view_graph.overlaps`, are measured: 0.5 in Li and
        Zhu.
    max_rounds : int
        Maximum number of rounds of registration and averaging: 30 in the published code of Li and
        Zhu.
    dense : bool
        Measure against all the raw points of the target. The papers measure against the thinned
        scan; point-to-point refinement then leaves the Bunny worse than the growing strategy did.
    guarded : bool
        Undo a round after which the surfaces fit worse, see
        `mvreg.surface.consistency.fit_score`, and stop. The papers have no such test; but a few
        wrong relative motions distort all poses.
    """

    min_overlap: float = 0.5
    max_rounds: int = 30
    dense: bool = True
    guarded: bool = True

    def __post_init__(self) -> None:
        if not 0 <= self.min_overlap < 1:
            raise InputError(
                f"adjust.min_overlap: expected a share in [0, 1), got {self.min_overlap}"
            )
        if self.max_rounds < 0:
            raise InputError(f"adjust.max_rounds: expected 0 or more, got {self.max_rounds}")

    def weights(self, edges: Sequence[Edge]) -> Array:
        """How much each edge counts (E,): all the same."""
        return np.ones(len(edges))

    def __call__(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        return over_components(result, lambda part: self.improved(part, views, pipeline))

    def improved(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        """Adjust one partial model with its reference fixed."""
        placed = [view for view in views if view.name in result.poses]
        if len(placed) < 2:
            return result
        targets = dense(placed) if self.dense else placed
        best, score = result, fit_score(result.poses, placed)
        for _ in range(self.max_rounds):
            edges = view_graph.edges(best, placed, pipeline.refine, self.min_overlap, targets)
            found = self.averaged(best, placed, edges)
            if found is best:
                break
            now = fit_score(found.poses, placed)
            if self.guarded and now < score:
                break
            step = farthest(placed, best.poses, found.poses)
            best, score = found, now
            if step <= STILL:
                break
        return best

    def averaged(self, result: Result, views: Sequence[View], edges: Sequence[Edge]) -> Result:
        """The result with averaged poses; itself if no edge leads to the reference."""
        names = [view.name for view in views]
        motions = np.stack([result.poses[name] for name in names])
        reference = names.index(result.reference)
        motions, moved = average(motions, edges, self.weights(edges), reference)
        if not moved:
            return result
        found = dict(zip(names, motions, strict=True))
        return replace(result, poses={name: found[name] for name in result.poses}, model=None)


@dataclass(frozen=True)
class WeightedMotionAveraging(MotionAveraging):
    """Motion averaging in which an edge counts as much as its views overlap.

    Guo et al. 2017, "Weighted motion averaging for the registration of multi-view range scans":
    motions estimated from little overlap are less reliable. All else, including the parameters, is
    `MotionAveraging`.
    """

    def weights(self, edges: Sequence[Edge]) -> Array:
        """How much each edge counts (E,): its overlap."""
        return np.array([edge.overlap for edge in edges])
