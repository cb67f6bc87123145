"""Blocks of the inverse of a sparse matrix where the matrix has blocks, and no others."""

from __future__ import annotations

from collections.abc import Iterable
from heapq import heapify, heappop, heappush

import numpy as np

from mvreg.types import Array, Indices


def elimination(count: int, pairs: Iterable[tuple[int, int]]) -> tuple[Indices, list[Indices]]:
    """An order of nodes that fills in little (least degree first), and who is left beside each.

    Parameters
    ----------
    count : int
        Of the nodes.
    pairs : iterable of (int, int)
        Nodes that are joined.

    Returns
    -------
    (N,) array
        The nodes in the order in which they are eliminated.
    list of arrays
        For the one eliminated k-th, the later ones that it is joined to by then, by their places in
        that order, ascending.
    """
    beside: list[set[int]] = [set() for _ in range(count)]
    for one, other in pairs:
        if one != other:
            beside[one].add(other)
            beside[other].add(one)
    waiting = [(len(near), node) for node, near in enumerate(beside)]
    heapify(waiting)
    place, order, left = np.full(count, -1), list[int](), list[list[int]]()
    while waiting:
        degree, node = heappop(waiting)
        if place[node] >= 0 or degree != len(beside[node]):
            continue
        place[node] = len(order)
        order.append(node)
        near = beside[node]
        left.append(sorted(near))
        for other in near:
            beside[other] |= near
            beside[other] -= {node, other}
            heappush(waiting, (len(beside[other]), other))
    return np.array(order, dtype=np.intp), [np.sort(place[near]) for near in left]


def selected_inverse(rows: Indices, columns: Indices, blocks: Array, count: int) -> SelectedInverse:
    """Factor a symmetric matrix of blocks, and find the blocks of its inverse (Takahashi 1973).

    Only those are found that the factors have, in which all blocks of the matrix are; the work is
    that of factoring. The matrix may be complex, and symmetric all the same.

    Parameters
    ----------
    rows, columns : (B,) arrays
        Where the blocks are, with ``rows <= columns``; each place once.
    blocks : (B, h, h) array
    count : int
        Rows of blocks in the matrix.
    """
    order, later = elimination(count, zip(rows.tolist(), columns.tolist(), strict=True))
    place = np.empty(count, dtype=np.intp)
    place[order] = np.arange(count)
    high = blocks.shape[1]
    index = {(k, k): k for k in range(count)}
    for k, near in enumerate(later):
        for other in near.tolist():
            index[k, other] = len(index)
    store = np.zeros((len(index), high, high), dtype=blocks.dtype)
    for row, column, block in zip(
        place[rows].tolist(), place[columns].tolist(), blocks, strict=True
    ):
        turned = row > column
        store[index[min(row, column), max(row, column)]] += block.T if turned else block
    inverse = store.copy()
    fronts = []
    for k, near in enumerate(later):
        own = np.array([index[k, other] for other in near.tolist()], dtype=np.intp)
        beside = near.tolist()
        joined = np.array(
            [[index[min(a, b), max(a, b)] for b in beside] for a in beside], dtype=np.intp
        ).reshape(len(beside), len(beside))
        across = np.concatenate([*store[own], np.empty((high, 0))], axis=1)
        scaled = np.linalg.solve(store[k], across)
        fronts.append((own, joined, scaled))
        upper = np.triu_indices(len(beside))
        taken = (across.T @ scaled).reshape(len(beside), high, len(beside), high)
        store[joined[upper]] -= taken.swapaxes(1, 2)[upper]
    for k in reversed(range(count)):
        own, joined, scaled = fronts[k]
        size = len(own)
        inner = inverse[joined]
        low = np.tril_indices(size, -1)
        inner[low] = inner[low].swapaxes(1, 2)
        inner = inner.swapaxes(1, 2).reshape(size * high, size * high)
        beside_ = -scaled @ inner
        inverse[k] = np.linalg.inv(store[k]) - beside_ @ scaled.T
        inverse[own] = beside_.reshape(high, size, high).swapaxes(0, 1)
    return SelectedInverse(index, place, inverse)


class SelectedInverse:
    """Some blocks of an inverse; ``found[i, j]`` is (h, h), a KeyError where it is not known."""

    def __init__(self, index: dict[tuple[int, int], int], place: Indices, blocks: Array) -> None:
        self._index, self._place, self._blocks = index, place, blocks

    def __getitem__(self, at: tuple[int, int]) -> Array:
        row, column = (int(self._place[node]) for node in at)
        block: Array = self._blocks[self._index[min(row, column), max(row, column)]]
        return block if row <= column else block.T
