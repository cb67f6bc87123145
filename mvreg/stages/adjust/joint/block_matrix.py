"""Matrices over the unknowns of all poses: dense for few poses, SciPy's sparse ones for many."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from mvreg.types import Array, Indices

#: So many poses are few: they are solved for in less time than it takes to import `scipy.sparse`.
FEW = 32


def of_blocks(blocks: Array, rows: Indices, columns: Indices, shape: tuple[int, int]) -> Any:
    """Assemble a matrix from blocks; those at the same place are summed.

    Parameters
    ----------
    blocks : (B, h, w) array
    rows, columns : (B,) arrays
        Where each one is, counted in blocks.
    shape : (int, int)
        Of the matrix, counted in blocks; one column for each pose.

    Returns
    -------
    array or scipy.sparse.csc_matrix
        With `shape` times (h, w) rows and columns.
    """
    high, wide = blocks.shape[1:]
    size = shape[0] * high, shape[1] * wide
    if shape[1] <= FEW:
        sums = np.zeros((*shape, high, wide))
        np.add.at(sums, (rows, columns), blocks)
        return np.ascontiguousarray(np.swapaxes(sums, 1, 2)).reshape(size)
    from scipy.sparse import coo_matrix

    down, across = np.meshgrid(np.arange(high), np.arange(wide), indexing="ij")
    places = high * rows[:, None, None] + down, wide * columns[:, None, None] + across
    entries = blocks.ravel(), tuple(place.ravel() for place in places)
    return coo_matrix(entries, shape=size).tocsc()


def between_poses(blocks: Array, sources: Indices, targets: Indices, count: int) -> Any:
    """What blocks (B, 6, 6) say of differences of two poses each, assembled as by `of_blocks`.

    Each is added on the diagonal at both poses, and taken off where they meet; a negative place is
    that of a pose that is held. Of those that are free there are `count`.
    """
    here, there = sources >= 0, targets >= 0
    both = here & there
    return of_blocks(
        np.concatenate([blocks[here], blocks[there], -blocks[both], -blocks[both]]),
        np.concatenate([sources[here], targets[there], sources[both], targets[both]]),
        np.concatenate([sources[here], targets[there], targets[both], sources[both]]),
        (count, count),
    )


def solver(matrix: Any, damping: float) -> Callable[[Array], Array]:
    """A solver for right-hand sides (n,) or (n, r), with `damping` times its mean on the diagonal.

    SciPy's sparse LU is factored once.
    """
    added = damping * (matrix.diagonal().mean() or 1.0)
    size = matrix.shape[0]
    if isinstance(matrix, np.ndarray):
        return partial(np.linalg.solve, matrix + added * np.eye(size))
    from scipy.sparse import identity
    from scipy.sparse.linalg import splu

    solve: Callable[[Array], Array] = splu((matrix + added * identity(size)).tocsc()).solve
    return solve


def dense(matrix: Any) -> Array:
    """A matrix made by `of_blocks` as an array."""
    found: Array = matrix if isinstance(matrix, np.ndarray) else matrix.toarray()
    return found


def blocks_at(matrix: Any, rows: Indices, columns: Indices, size: int = 6) -> Array:
    """The blocks (B, size, size) of a matrix made by `of_blocks`, at places where it has some."""
    if isinstance(matrix, np.ndarray):
        many = len(matrix) // size
        found: Array = matrix.reshape(many, size, many, size).swapaxes(1, 2)[rows, columns]
        return found
    blocks = matrix.tobsr((size, size))
    blocks.sort_indices()
    many = blocks.shape[0] // size
    keys = np.repeat(np.arange(many), np.diff(blocks.indptr)) * many + blocks.indices
    chosen: Array = blocks.data[np.searchsorted(keys, rows * many + columns)]
    return chosen
