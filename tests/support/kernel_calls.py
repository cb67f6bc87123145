"""A call of every public entry of the kernels, and what its arguments may be instead."""

import functools

import numpy as np

from mvreg.kernels import (
    anderson,
    contacts,
    descriptor_matches,
    descriptors,
    evidence,
    fit,
    grid,
    hidden,
    icp,
    lzf,
    moments,
    normal_equations,
    overlap,
    patches,
    propagate,
    ransac,
    rays,
    residuals,
    text,
    trimmed_pairs,
    way_sums,
)
from mvreg.kernels.tree import Tree

N, K = 40, 30
HUGE = 2**62


@functools.cache
def made():
    """One of everything that a kernel asks for; kernels change none of it."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(N, 3))
    normals = rng.normal(size=(N, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    scales = np.repeat(normals[:K, None], 2, axis=1)
    index = Tree(points)
    axes = np.repeat(np.eye(3)[None], N, axis=0)
    whole, bends = np.ones(N, bool), np.zeros((N, 3))
    parts = points, axes, bends[:, :2], bends, normals, np.ones(N), whole, whole, points, axes
    return {
        "points": points, "normals": normals, "scales": scales, "tree": index, "axes": axes,
        "words": rng.normal(size=(K, 6)), "parts": parts, "patches": patches.Patches(index, *parts),
        "shape": propagate.Shape(points[:K], scales, rng.normal(size=(K, 6))),
        "rays": rays.Rays(points, np.array([0.0, 0, 1]), None, 0.5),
        "pairs": np.stack([np.arange(12), np.arange(12)], axis=1),
        "draws": rng.integers(0, 6, size=(2, 5, 3)), "motion": np.eye(4),
        "motions": np.stack([np.eye(4)] * 2), "ways": np.array([[0, 1], [1, 0]]),
        "jacobian": rng.normal(size=(12, 6)),
        "contacts": (
            np.array([[0, 1], [1, 0]]), np.array([0, 6, 12]), np.arange(12),
            np.arange(12), np.array([0, N, 2 * N]),
        ),
    }  # fmt: skip


def rows_given():
    """A call's arguments of `residuals.rows`; it writes into the last four."""
    m, some = made(), np.arange(12)
    out = np.zeros(12), np.zeros((12, 6)), np.zeros((12, 3)), np.zeros(12)
    return (
        [m["patches"]] * 2, m["motions"], m["ways"], np.array([0, 6, 12]), some, some, np.zeros(3),
        1.0, True, *out,
    )  # fmt: skip


def cases():
    """For each public entry, what is called, and with what: that is fine as it is."""
    m = made()
    points, index, motion = m["points"], m["tree"], m["motion"]
    twelve, ends = np.ones(12), np.array([0, 6, 12])
    owners = np.arange(N) % 3
    words = np.random.default_rng(1).normal(size=(N, 6))
    found = descriptors.DescriptorTree(words, owners)
    up = np.array([0.0, 0, 1])
    sight = index, m["normals"], points, m["normals"]
    some = 1.0, 0.01, 0.4
    pairing = trimmed_pairs.Pairing(index, points, 1.0, 0.4, 3.0)
    sorted_rows = descriptor_matches.Rows(m["words"])
    return {
        "descriptors.DescriptorTree": (descriptors.DescriptorTree, (words, owners)),
        "descriptors.DescriptorTree.foreign": (found.foreign, (np.arange(5), 3, 0.1)),
        "rays.Rays": (rays.Rays, (points, None, 9 * up, 0.5)),
        "rays.Rays.nearby": (m["rays"].nearby, (points, 4)),
        "evidence.directed_evidence": (
            evidence.directed_evidence,
            (*sight, np.zeros(3), 4.0, motion, 0.5, 0.5, True, m["rays"], 4, 0.1, 0.1),
        ),
        "evidence.which_may_overlap": (
            evidence.which_may_overlap,
            (up, 1.0, m["rays"], 0.5, points, np.ones(N), [m["rays"], None] * (N // 2),
             np.ones(N), np.stack([motion] * N)),
        ),
        "overlap.contact_heights": (overlap.contact_heights, (*sight, motion, 0.5, 0.5)),
        "overlap.box": (overlap.box, (points, motion)),
        "hidden.hidden": (hidden.hidden, (points, m["normals"][:5], up, 0.2, 0.1)),
        "fit.fit": (fit.fit, (index, points, m["axes"], 8, 1e-3)),
        "grid.Cells": (grid.Cells, (points, 0.3)),
        "trimmed_pairs.Pairing": (trimmed_pairs.Pairing, (index, points, 1.0, 0.4, 3.0)),
        "anderson.Acceleration": (anderson.Acceleration, (pairing,)),
        "trimmed_pairs.trimmed": (trimmed_pairs.trimmed, (index, points, 1.0, 0.4, 3.0)),
        "icp.trimmed_icp": (icp.trimmed_icp, (index, points, motion, *some, 3.0, 5, 0.1, True)),
        "icp.plane_icp": (
            icp.plane_icp, (index, m["normals"], points, motion, *some, 2.0, 5, 0.1, 0.1, True),
        ),
        "patches.Patches": (patches.Patches, (index, *m["parts"])),
        "patches.Patches.arrays": (m["patches"].arrays, ()),
        "patches.gaps": (patches.gaps, (m["patches"], points, np.arange(N), False)),
        "contacts.contacts": (
            contacts.contacts,
            ([m["patches"]] * 2, m["motions"], m["ways"], 0.5, 1, False, 0.5, np.ones(2, bool)),
        ),
        "residuals.rows": (residuals.rows, rows_given()),
        "normal_equations.normal_equations": (
            normal_equations.normal_equations, (m["jacobian"], twelve, twelve, ends, 1.0),
        ),
        "normal_equations.group_sums": (
            normal_equations.group_sums,
            (m["jacobian"], twelve, twelve, np.arange(12) % 5, ends, 1.0),
        ),
        "way_sums.normal_equations": (
            way_sums.normal_equations,
            ([m["patches"]] * 2, m["motions"], *m["contacts"], np.ones((2 * N, 2)),
             np.ones((2 * N, 3)), np.zeros(3), 1.0, True, 1.0),
        ),
        "way_sums.known_at": (way_sums.known_at, (*m["contacts"], np.ones((2 * N, 2)))),
        "residuals.farthest": (residuals.farthest, (points, motion, motion)),
        "moments.moments": (moments.moments, (index, points, np.array([0.2, 0.5, 1.0]))),
        "moments.normals": (moments.normals, (index, points, 6)),
        "propagate.About": (propagate.About, ()),
        "propagate.Shape": (propagate.Shape, (points[:K], m["scales"], m["words"])),
        "descriptor_matches.Rows": (descriptor_matches.Rows, (m["words"],)),
        "descriptor_matches.Rows.nearest": (sorted_rows.nearest, (m["words"][:5],)),
        "propagate.spread": (
            propagate.spread, (m["shape"], m["shape"], m["pairs"], True, 0.5, 0.2, 9.0, 1),
        ),
        "ransac.consensus": (
            ransac.consensus, (points[:K], points[:K], m["pairs"], ends, m["draws"], 0.5),
        ),
        "lzf.decompress": (lzf.decompress, (b"\x00a" * 5, 5)),
        "text.parse_rows": (text.parse_rows, (b"x\n1 2 3\n4 5 6\n", 2, 2, 3)),
        "tree.Tree": (Tree, (points,)),
        "tree.Tree.query": (index.query, (points, [1, 3], 0.5)),
        "tree.Tree.nearest": (index.nearest, (points, 0.5)),
        "tree.Tree._many": (index._many, (points, 4, 0.5)),
    }  # fmt: skip


def spoilt_array(array):
    """What an array may be instead: the wrong shape, range, kind or layout."""
    yield np.empty((0, *array.shape[1:]), array.dtype)
    yield np.empty(0)
    yield array[:-1]
    yield np.concatenate([array, array])
    yield array[None]
    yield array[..., :-1]
    yield array[..., 0]
    yield np.asarray(0.0)
    yield array.astype(complex)
    yield array.astype(str)
    yield array.astype(np.float32)
    yield array.astype(np.int32)
    yield array.astype(object)
    yield np.repeat(array, 2, axis=0)[::2]
    yield np.asfortranarray(array)
    yield array[::-1]
    shut = array.copy()
    shut.flags.writeable = False
    yield shut
    for value in (-1, -HUGE, array.size, 2**31, HUGE, np.nan, np.inf, -np.inf, 1e308, -1e-320):
        for place in (0, -1, slice(None)):
            wrong = array.copy()
            wrong = wrong if isinstance(value, int) else wrong.astype(float)
            if wrong.dtype == bool:
                continue
            wrong.reshape(-1)[place] = value
            yield wrong


def spoilt(value):
    """What an argument may be instead."""
    yield None
    yield "nonsense"
    if isinstance(value, np.ndarray):
        yield from spoilt_array(value)
    elif isinstance(value, int | float):
        yield from (0, -1, 1, 2, 65, 129, 200, HUGE, 2**63 - 1, -(2**63), 2**70)
        yield from (0.5, -0.0, np.nan, np.inf, -np.inf, 1e-320, 1e308, -1e308)
    elif isinstance(value, list):
        yield from ([], [0], [-1, 2], [None, None], value[:1], 2 * value, np.array([-3.0]), [HUGE])
    elif isinstance(value, bytes):
        yield from (b"", b"\0" * 9, value[:-2], bytearray(value))
    else:
        empty = np.empty((0, 3))
        yield from (Tree(empty), rays.Rays(empty, None, np.zeros(3), 1.0))
        yield propagate.Shape(empty, np.empty((0, 2, 3)), np.empty((0, 6)))
        yield propagate.Shape(empty, np.empty((0, 1, 3)), np.empty((0, 2)))
