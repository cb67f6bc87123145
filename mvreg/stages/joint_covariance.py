"""How well the poses of a joint refinement are known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mvreg.stages.joint_system import Frame, Rows, System, curvature, weight
from mvreg.types import Array

#: Columns solved for at a time: bounds the memory.
BATCH = 256


def covariances(
    found: Sequence[Rows], system: System, frame: Frame, width: float, cell: float
) -> Array:
    """Covariances (F, 6, 6) of the free poses' twists, about the model frame's origin.

    The inverse of the normal equations, times the variance of the residuals. That variance is not
    that of one residual: neighbouring samples share raw points, a sample has a residual to every
    scan that it lies on, and what the scans get wrong together (a bent range image, say) extends
    over many. So residuals are taken together by cells of space, and what counts is how much the
    cells' sums vary: ``tr(A^-1 B) / p`` for the normal equations A, the sum B of the outer products
    of the cells' gradients, and p unknowns (the middle of the sandwich of Liang and Zeger 1986, of
    which only the size is used, not the shape, which few cells tell badly). Assumed is that cells
    are independent of each other: errors of a scan that are wider than a cell do not show here.

    Parameters
    ----------
    found : sequence of Rows
        At the optimum.
    system : System
        Theirs, under the same kernel.
    frame : Frame
    width : float
        Of the kernel, in the frame's radius.
    cell : float
        Edge of the cells, in the frame's radius.
    """
    solver = system.factor()
    cells = _cell_gradients(found, system, width, cell)
    count, unknowns = cells.shape
    ratio = 0.0
    for start in range(0, count, BATCH):
        some = cells[start : start + BATCH].toarray()
        ratio += float((some * solver.solve(some.T).T).sum())
    # A robust optimum is flatter than its weights say (Huber 1981, Section 7.6); and residuals
    # shrink by what the unknowns take out of them.
    flatter = _total(found, width, weight) / max(_total(found, width, curvature), 1e-12)
    variance = ratio / unknowns * flatter**2 * count / max(count - unknowns, 1)
    change = frame.twists
    blocks = []
    for start in range(0, unknowns, 6):
        unit = np.zeros((unknowns, 6))
        unit[start : start + 6] = np.eye(6)
        block = solver.solve(unit)[start : start + 6]
        blocks.append(variance * change @ ((block + block.T) / 2) @ change.T)
    return np.array(blocks).reshape(-1, 6, 6)


def _total(found: Sequence[Rows], width: float, kernel: Callable[[Array, float], Array]) -> float:
    return float(sum((one.weights * kernel(one.residuals, width)).sum() for one in found))


def _cell_gradients(found: Sequence[Rows], system: System, width: float, cell: float) -> Any:
    """Sparse (G, 6 F): the gradient of every cell's residuals."""
    from scipy.sparse import coo_matrix

    points = np.concatenate([one.points for one in found])
    places = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    across = places.max(axis=0) + 1
    keys = (places[:, 0] * across[1] + places[:, 1]) * across[2] + places[:, 2]
    _, where = np.unique(keys, return_inverse=True)
    values, lines, columns, start = [], [], [], 0
    for one in found:
        size = len(one.residuals)
        slopes = (
            one.jacobian * (one.weights * weight(one.residuals, width) * one.residuals)[:, None]
        )
        for k, sign in ((one.i, 1.0), (one.j, -1.0)):
            if k in system.place:
                values.append(sign * slopes.ravel())
                lines.append(np.repeat(where[start : start + size], 6))
                columns.append(np.tile(6 * system.place[k] + np.arange(6), size))
        start += size
    shape = (int(where.max()) + 1, len(system.gradient))
    entries = (np.concatenate(lines), np.concatenate(columns))
    return coo_matrix((np.concatenate(values), entries), shape=shape).tocsr()
