"""Covariances of the poses of a joint refinement."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mvreg.kernels.normal_equations import cell_sums
from mvreg.stages.adjust.joint.block_matrix import of_blocks, some_columns
from mvreg.stages.adjust.joint.normal_equations import Frame, Rows, System, curvature, weight
from mvreg.types import Array

#: Columns solved for at a time, a multiple of six: bounds the memory.
BATCH = 252


def covariances(found: Rows, system: System, frame: Frame, width: float, cell: float) -> Array:
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
    found : Rows
        At the optimum.
    system : System
        Theirs, under the same kernel.
    frame : Frame
    width : float
        Of the kernel, in the frame's radius.
    cell : float
        Edge of the cells, in the frame's radius.
    """
    cells = _cell_gradients(found, system, width, cell)
    count, unknowns = cells.shape
    ratio, blocks = _inverse(system, cells.T @ cells)
    # A robust optimum is flatter than its weights say (Huber 1981, Section 7.6); and residuals
    # shrink by what the unknowns take out of them.
    flatter = _total(found, width, weight) / max(_total(found, width, curvature), 1e-12)
    variance = ratio / unknowns * flatter**2 * count / max(count - unknowns, 1)
    change = frame.twists
    return np.array(
        [variance * change @ ((block + block.T) / 2) @ change.T for block in blocks]
    ).reshape(-1, 6, 6)


def _inverse(system: System, sums: Any) -> tuple[float, list[Array]]:
    """Of the inverse of the normal equations: the trace of its product with `sums`, and its blocks.

    `sums` is (6 F, 6 F); the blocks (6, 6) are those on the diagonal.
    """
    solve, unknowns = system.solver(), len(system.gradient)
    trace, blocks = 0.0, list[Array]()
    for start in range(0, unknowns, BATCH):
        stop = min(start + BATCH, unknowns)
        unit = np.zeros((unknowns, stop - start))
        unit[start:stop] = np.eye(stop - start)
        columns = solve(unit)
        trace += float((columns * some_columns(sums, start, stop)).sum())
        blocks += [columns[k : k + 6, k - start : k - start + 6] for k in range(start, stop, 6)]
    return trace, blocks


def _total(found: Rows, width: float, kernel: Callable[[Array, float], Array]) -> float:
    return float(found.weights @ kernel(found.residuals, width))


def _cell_gradients(found: Rows, system: System, width: float, cell: float) -> Any:
    """(G, 6 F): the gradient of every cell's residuals, laid out as in `block_matrix`."""
    low, high = found.points.min(axis=0), found.points.max(axis=0)
    across, weights = np.floor((high - low) / cell).astype(np.int64) + 1, found.weights
    sums = found.in_parts(
        lambda _, ends: cell_sums(
            found.jacobian, found.residuals, weights, found.points, ends, width, low,
            cell, across,
        )
    )  # fmt: skip
    counts = np.concatenate([np.diff(part.ends) for part in sums])
    _, cells = np.unique(np.concatenate([part.cells for part in sums]), return_inverse=True)
    slopes = np.concatenate([part.sums for part in sums])[:, None]
    source, target = np.repeat(system.place[found.contacts.ways], counts, axis=0).T
    here, there = source >= 0, target >= 0
    return of_blocks(
        np.concatenate([slopes[here], -slopes[there]]),
        np.concatenate([cells[here], cells[there]]),
        np.concatenate([source[here], target[there]]),
        (int(cells.max()) + 1, len(system.gradient) // 6),
    )
