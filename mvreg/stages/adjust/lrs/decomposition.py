"""Low-rank and sparse decomposition of a matrix of relative motions.

After Arrigoni, Rossi and Fusiello, "Global registration of 3D point sets via LRS decomposition",
ECCV 2016, whose L1-ALM is that of Zheng et al., "Practical low-rank matrix approximation under
robust L1-norm", CVPR 2012.
"""

from __future__ import annotations

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array

#: The rank of a matrix of relative motions: one block column of 4x4 blocks.
RANK = 4
#: Of the published code: weight of the nuclear norm, first penalty and its growth, most iterations,
#: and how closely, relative to the data, the low-rank matrix must be met.
NUCLEAR, PENALTY, GROWTH, MAX_ITERATIONS, TOLERANCE = 1e-3, 1e-6, 1.2, 5000, 1e-7
#: Where the penalty stops growing: beyond, sums lose their digits.
MOST_PENALTY = 1e12


def decompose(data: Array, weights: Array, start: Array) -> Array:
    """The matrix of rank 4 nearest to the data in the sum of weighted absolute differences.

    Minimises ``|W o (X - U V)|_1 + 1e-3 |V|_*`` with ``U^T U = I`` by an augmented Lagrangian.

    Parameters
    ----------
    data : (M, M) array
        X; what is unknown may be anything finite.
    weights : (M, M) array
        W, not negative; 0 where X is unknown.
    start : (M, M) array
        Where E, the stand-in for U V, begins.

    Returns
    -------
    (M, M) array
        U V, with zero weight or without.
    """
    low, multiplier, penalty = start, np.zeros_like(data), PENALTY
    right = np.linalg.svd(start)[2][:RANK]
    close = TOLERANCE * np.linalg.norm(data[weights > 0])
    product = start
    for _ in range(MAX_ITERATIONS):
        wanted = low + multiplier / penalty
        u, _, vt = np.linalg.svd(wanted @ right.T, full_matrices=False)
        left = u @ vt
        u, values, vt = np.linalg.svd(left.T @ wanted, full_matrices=False)
        right = u @ (np.maximum(values - NUCLEAR / penalty, 0)[:, None] * vt)
        product = left @ right
        rest = data - product + multiplier / penalty
        sparse = np.sign(rest) * np.maximum(np.abs(rest) - weights / penalty, 0)
        low = np.where(weights > 0, data - sparse, product - multiplier / penalty)
        gap = low - product
        if np.abs(gap).max() < close:
            break
        multiplier = multiplier + penalty * gap
        penalty = min(GROWTH * penalty, MOST_PENALTY)
    return product


def synchronise(relative: Array, weights: Array, poses: Array, reference: int) -> Array:
    """Robust synchronisation: poses that agree with most relative motions exactly, if possible.

    A matrix of blocks ``X_ij = M_i^-1 M_j`` is ``[M_i^-1] [M_j]``, of rank 4: what disagrees with
    a few of the blocks, or misses some, is told from the others. Before, the blocks are expressed
    at the poses given, ``M_i X_ij M_j^-1``, in the frame of the scene: its centre and size make a
    turn and a shift count alike, whatever frames the scans came in. (The original divides by the
    longest shift instead.)

    Parameters
    ----------
    relative : (N, N, 4, 4) array
        ``T_i_j``, from view j to view i.
    weights : (N, N) array
        How much each counts; 0 where it is unknown. The diagonal is known.
    poses : (N, 4, 4) array
        ``T_scene_view`` to start from, lengths of the order of one.
    reference : int
        The view whose pose stays.

    Returns
    -------
    (N, 4, 4) array
        Poses in the same frame; those of rows that came out as no motion at all stay.
    """
    count = len(poses)
    blocks = poses[:, None] @ relative @ se3.invert(poses)[None]
    data = np.where((weights > 0)[..., None, None], blocks, np.diag([0.0, 0, 0, 1]))
    data[np.arange(count), np.arange(count)] = np.eye(4)
    certain = weights.max(initial=1.0)
    entries = np.repeat(weights[..., None, None], 4, axis=2) * np.ones((1, 1, 1, 4))
    entries[:, :, 3] = certain  # fourth rows are known everywhere
    entries[np.arange(count), np.arange(count)] = certain
    start = np.tile(np.eye(4), (count, count))
    low = decompose(as_matrix(data), as_matrix(entries), start)
    row = low.reshape(count, 4, count, 4)[reference].transpose(1, 0, 2)
    return placed(row, poses, reference)


def as_matrix(blocks: Array) -> Array:
    """(4N, 4N) matrix of blocks (N, N, 4, 4)."""
    side = 4 * len(blocks)
    return blocks.transpose(0, 2, 1, 3).reshape(side, side)


def placed(row: Array, poses: Array, reference: int) -> Array:
    """Poses from the reference's block row (N, 4, 4) of corrections, made rigid."""
    row = np.where(np.isfinite(row).all(axis=(1, 2), keepdims=True), row, 0.0)
    scale = row[:, 3, 3]
    sound = (scale > 0) & (np.linalg.det(row[:, :3, :3]) > 0)
    new = poses.copy()
    if not sound[reference]:
        return new
    own = se3.project(row[reference] / scale[reference])
    for index in np.flatnonzero(sound):
        correction = se3.invert(own) @ se3.project(row[index] / scale[index])
        new[index] = se3.project(correction @ poses[index])
    new[reference] = poses[reference]
    return new
