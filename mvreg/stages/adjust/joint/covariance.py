"""Covariances of the poses of a joint refinement: of each, and of one relative to another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mvreg.geometry import se3
from mvreg.stages.adjust.joint.block_matrix import blocks_at, dense, of_blocks, solver
from mvreg.stages.adjust.joint.clusters import Cells, Clusters
from mvreg.stages.adjust.joint.frame import Frame
from mvreg.stages.adjust.joint.normal_equations import DAMPING, System, curvature, weight
from mvreg.stages.adjust.joint.rows import Residuals, Rows
from mvreg.stages.adjust.joint.selected import selected_inverse
from mvreg.types import Array, Indices
from mvreg.types.scatter import PoseScatter

#: So many poses are inverted as a dense matrix: a second for 1.5 times as many.
DENSE = 100
#: Part of the step along the imaginary axis that tells a derivative to the last digit.
STEP = 1e-10
#: Cells are halved, to so many sizes at most, until poses take no more than this share of what the
#: sums of their residuals scatter: the rest would have to tell all of it.
MOST_LOST, SIZES = 0.5, 3
#: Classes of how well points are known, as many samples in each. From 4 to 5 and from 5 to 6
#: classes the normalised squared errors of poses fall by a tenth.
CLASSES = 4


def classes(values: Array, count: int = CLASSES) -> Indices:
    """The class (S,) of each value (S,), as many in each."""
    edges = np.unique(np.quantile(values, np.arange(1, count) / count))
    found: Indices = np.searchsorted(edges, values)
    return found


def pose_scatter(
    found: Rows | Residuals, system: System, stiff: Any, frame: Frame, width: float,
    variance: float, graded: Sequence[Callable[[Rows], Indices]],
    names: tuple[Sequence[str], Sequence[str]],
) -> PoseScatter:  # fmt: skip
    """How the free poses of a joint refinement err together.

    A sandwich: what scatters between the inverses of what holds the poses, `stiff`. Neighbouring
    samples share raw points, a sample has a residual to every scan that it lies on, and what the
    scans get wrong together (a bent range image, say) extends over many. So residuals are taken
    together, twice. By cells of space, many, they tell the variance of residuals in units of what
    each is expected to be, which stands for all of them alike: few cells bear on one pose, and the
    shape of their scatter would be told badly. By how well the points at either end are known, few
    classes, their sums are taken as they are: what is biased, as points are that graze a surface,
    those on relief or far away, is so in all scans alike, and adds up along chains of them.
    Clusters of two kinds (Cameron, Gelbach and Miller 2011), of which what is in both is counted
    twice rather than taken off: that is never indefinite, and errs on the safe side (Davezies,
    D'Haultfoeuille and Guyonvarch 2021). What fitted poses take out of the sums is put back, by
    what each group says of each pose (Bell and McCaffrey 2002).

    Parameters
    ----------
    found : Rows or Residuals
        At the optimum.
    system : System
        Theirs, under the same kernel.
    stiff : array or sparse matrix
        (6 F, 6 F), see `mvreg.stages.adjust.joint.stiffness`.
    frame : Frame
    width : float
        Of the kernel, in units of the residuals.
    variance : float
        Of the residuals in their units, see `cell_variance`.
    graded : sequence of callable
        Classes of the residuals, one kind after another: of some of the rows (m,) that of each.
    names : two sequences of str
        Of the free scans, and of the fixed ones.
    """
    flatter = flatness(found, width)
    modes = [np.zeros((len(names[0]), 6, 0))]
    for groups in graded:
        classed = Clusters.of(found, system, groups, width)
        if classed.count > 1:  # the sum of all is zero at an optimum
            modes.append(classed.modes())
    places = _places(system.place[found.contacts.ways], len(names[0]))
    scores = blocks_at(system.normal, *places.T)
    held, own = blocks_at(stiff, *places.T), places[:, 0] == places[:, 1]
    least = DAMPING * float(np.diagonal(scores[own], axis1=1, axis2=2).mean())
    held[own] += (least or 1.0) * np.eye(6)
    return PoseScatter(
        tuple(names[0]), tuple(names[1]), frame.twists, places, held,
        flatter**2 * variance * scores, flatter * np.concatenate(modes, axis=2),
    )  # fmt: skip


def cell_variance(found: Rows | Residuals, system: System, width: float, cell: float) -> float:
    """The variance of residuals in their units, by how much their sums over cells vary."""
    for _ in range(SIZES):
        clusters = Clusters.of(found, system, Cells.about(found, cell), width)
        if clusters.lost <= MOST_LOST:
            break
        cell /= 2
    return clusters.variance


def covariance_blocks(scatter: PoseScatter) -> Blocks:
    """Covariances of the free poses' twists about the model frame's origin: each pose's, and more.

    Those of two poses are found where contacts join them, however many scans there are.
    """
    count = len(scatter.names)
    stiff = _matrix(scatter, scatter.stiffness)
    modes = scatter.modes.reshape(6 * count, -1)
    shared = (solver(stiff, 0.0)(modes) if modes.shape[1] else modes).reshape(scatter.modes.shape)
    if count <= DENSE:
        inverse = np.linalg.inv(dense(stiff))
        both = inverse @ dense(_matrix(scatter, scatter.scores)) @ inverse
        blocks = both.reshape(count, 6, count, 6).swapaxes(1, 2)
        return Blocks(scatter.twists, shared, lambda i, j: blocks[i, j])
    # S^-1 V S^-1 is the derivative of (S - t V)^-1 for t, of which the blocks that S has are known.
    step = STEP * np.abs(scatter.stiffness).max() / max(np.abs(scatter.scores).max(), 1e-300)
    rows, columns = scatter.places.T
    found = selected_inverse(rows, columns, scatter.stiffness - 1j * step * scatter.scores, count)
    return Blocks(scatter.twists, shared, lambda i, j: found[i, j].imag / step)


class Blocks:
    """Blocks (6, 6) of the covariance of all free poses; ``blocks[i, j]``.

    A KeyError says that one was not found; a negative place is that of a pose that is held.
    """

    def __init__(self, twists: Array, shared: Array, block: Callable[[int, int], Array]) -> None:
        self._twists, self._shared, self._block = twists, shared, block

    def __getitem__(self, at: tuple[int, int]) -> Array:
        i, j = at
        if i < 0 or j < 0:
            return np.zeros((6, 6))
        block = self._block(i, j)
        if i == j:
            block = (block + block.T) / 2
        found: Array = self._twists @ (block + self._shared[i] @ self._shared[j].T) @ self._twists.T
        return found

    def relative(self, source: int, target: int, T_model_target: Array) -> Array:
        """As `relative_covariance`, of two free poses or held ones (negative places)."""
        apart = (
            self[source, source] + self[target, target]
            - self[source, target] - self[target, source]
        )  # fmt: skip
        change = se3.adjoint(se3.invert(T_model_target))
        found: Array = change @ ((apart + apart.T) / 2) @ change.T
        return found


def relative_covariance(
    scatter: PoseScatter, source: str, target: str, T_model_target: Array
) -> Array:
    """The covariance (6, 6) of one pose relative to another, joined by contacts or not.

    Parameters
    ----------
    scatter : PoseScatter
    source, target : str
        Two scans of its `names` or `fixed` ones.
    T_model_target : (4, 4) array
        The pose of the target.

    Returns
    -------
    (6, 6) array
        Of the twist in ``exp(twist) @ T_target_source``, in the target's frame, rotation (radians)
        before translation (length).
    """
    at = {name: k for k, name in enumerate(scatter.names)}
    unit = np.zeros((6 * len(at), 6))
    for name, sign in ((source, 1.0), (target, -1.0)):
        if name in at:
            unit[6 * at[name] : 6 * at[name] + 6] += sign * np.eye(6)
    along = solver(_matrix(scatter, scatter.stiffness), 0.0)(unit)
    scores, modes = _matrix(scatter, scatter.scores), scatter.modes.reshape(len(unit), -1)
    found = along.T @ (scores @ along) + (along.T @ modes) @ (modes.T @ along)
    change = se3.adjoint(se3.invert(T_model_target)) @ scatter.twists
    covariance: Array = change @ ((found + found.T) / 2) @ change.T
    return covariance


def _places(ways: Indices, count: int) -> Indices:
    """(B, 2): each free pose, and those of `ways` (W, 2) between two that are, the lower first."""
    free = np.sort(ways[(ways >= 0).all(axis=1)], axis=1)
    own = np.repeat(np.arange(count), 2).reshape(-1, 2)
    found: Indices = np.unique(np.concatenate([own, free]), axis=0)
    return found


def _matrix(scatter: PoseScatter, blocks: Array) -> Any:
    """The whole symmetric matrix (6 F, 6 F), laid out as in `block_matrix`."""
    rows, columns = scatter.places.T
    off, count = rows != columns, len(scatter.names)
    return of_blocks(
        np.append(blocks, np.swapaxes(blocks[off], 1, 2), axis=0),
        np.append(rows, columns[off]), np.append(columns, rows[off]), (count, count),
    )  # fmt: skip


def flatness(found: Rows | Residuals, width: float) -> float:
    """How many times as flat a robust optimum is as its weights say (Huber 1981, Section 7.6)."""
    return _total(found, width, weight) / max(_total(found, width, curvature), 1e-12)


def _total(found: Rows | Residuals, width: float, kernel: Callable[[Array, float], Array]) -> float:
    return float(found.weights @ kernel(found.residuals, width))
