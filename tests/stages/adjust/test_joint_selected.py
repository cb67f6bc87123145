"""Blocks of inverses, against the whole inverse."""

import numpy as np
import pytest

from mvreg.stages.adjust.joint.block_matrix import blocks_at, of_blocks
from mvreg.stages.adjust.joint.selected import elimination, selected_inverse


def graph(kind, count, rng):
    """Pairs i < j of nodes that are joined."""
    chain = {(k, k + 1) for k in range(count - 1)}
    if kind == "chain":
        return chain
    if kind == "apart":
        return {pair for pair in chain if pair[1] % 3}
    if kind == "all":
        return {(i, j) for j in range(count) for i in range(j)}
    return chain | {tuple(sorted(pair)) for pair in rng.integers(count, size=(count, 2)).tolist()}


@pytest.mark.parametrize("imaginary", [0.0, 1.0])
@pytest.mark.parametrize("count", [1, 2, 13])
@pytest.mark.parametrize("kind", ["chain", "apart", "all", "random"])
def test_selected_blocks_are_those_of_the_inverse(rng, kind, count, imaginary):
    size = 3
    pairs = sorted({(i, j) for i, j in graph(kind, count, rng) if i < j})
    rows, columns = np.array([*pairs, *((k, k) for k in range(count))]).T
    blocks = rng.normal(size=(len(rows), size, size)) + imaginary * 1j * rng.normal(
        size=(len(rows), size, size)
    )
    blocks = blocks if imaginary else blocks.real
    own = rows == columns
    blocks[own] = blocks[own] + np.swapaxes(blocks[own], 1, 2) + 20 * np.eye(size)
    whole = np.zeros((count, count, size, size), dtype=blocks.dtype)
    whole[rows, columns] = blocks
    whole[columns, rows] = np.swapaxes(blocks, 1, 2)
    flat = whole.swapaxes(1, 2).reshape(count * size, count * size)
    expected = np.linalg.inv(flat).reshape(count, size, count, size).swapaxes(1, 2)
    found = selected_inverse(rows, columns, blocks, count)
    for i, j in zip(rows, columns, strict=True):
        np.testing.assert_allclose(found[i, j], expected[i, j], atol=1e-12)
        np.testing.assert_allclose(found[j, i], expected[j, i], atol=1e-12)


def test_a_block_that_is_not_known_is_an_error():
    blocks = np.tile(np.eye(2), (3, 1, 1))
    found = selected_inverse(np.arange(3), np.arange(3), blocks, 3)
    with pytest.raises(KeyError):
        found[0, 2]


def test_a_chain_is_eliminated_without_fill():
    order, later = elimination(50, [(k, k + 1) for k in range(49)])
    assert sorted(order.tolist()) == list(range(50))
    assert max(map(len, later)) == 1


@pytest.mark.parametrize("count", [5, 40])
def test_blocks_of_dense_and_of_sparse_matrices(rng, count):
    rows = np.arange(count - 1)
    blocks = rng.normal(size=(count - 1, 6, 6))
    matrix = of_blocks(blocks, rows, rows + 1, (count, count))
    np.testing.assert_array_equal(blocks_at(matrix, rows, rows + 1), blocks)
