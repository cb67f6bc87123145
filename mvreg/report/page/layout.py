"""Where the nodes of the view graph are drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mvreg.types import Array, Indices

#: Steps of the layout, and the share of the drawing that a node moves by at first.
STEPS, FIRST = 150, 0.1
#: Between parts that nothing links, in nodes; and how wide the drawing is, of its height.
GAP, ASPECT = 1.2, 4 / 3


def layout(
    names: Sequence[str], links: Sequence[tuple[str, str]], start: Mapping[str, Array]
) -> dict[str, tuple[float, float]]:
    """Positions in the unit square: linked scans near each other, none on another.

    Springs and charges (Fruchterman and Reingold 1991) from the places that the scans have in the
    model, seen from the side that shows them widest; the same each time. Parts that nothing links
    lie beside each other, the largest first.

    Parameters
    ----------
    names : sequence of str
    links : sequence of pairs of names
    start : mapping of str to (3,) array
        Where each scan is; those that are missing begin in a row below.
    """
    if not names:
        return {}
    place = {name: k for k, name in enumerate(names)}
    pairs = np.array([(place[a], place[b]) for a, b in links], dtype=np.intp).reshape(-1, 2)
    part = _parts(len(names), pairs)
    parts = sorted((np.flatnonzero(part == k) for k in np.unique(part)), key=len, reverse=True)
    corners = _shelves([float(np.sqrt(len(members))) for members in parts])
    where = np.empty((len(names), 2))
    for members, corner in zip(parts, corners, strict=True):
        own = pairs[np.isin(pairs[:, 0], members)]
        begun = _start([names[int(k)] for k in members], start)
        side = np.sqrt(len(members))
        where[members] = corner + side * _springs(begun, np.searchsorted(members, own))
    where = _filled(where)
    return {name: (float(x), float(y)) for name, (x, y) in zip(names, where, strict=True)}


def _parts(count: int, pairs: Indices) -> Indices:
    """The first node (count,) that each is linked to, over any others.

    SciPy has it, but to import its graphs takes 30 MB and longer than the page.
    """
    part = np.arange(count)
    while True:
        before = part.copy()
        for one, other in (pairs.T, pairs.T[::-1]):
            np.minimum.at(part, one, before[other])
        part = part[part]
        if np.array_equal(part, before):
            return part


def _shelves(sides: Sequence[float]) -> Array:
    """Corners (M, 2) of squares of these sides, the largest first, one beside another in rows."""
    area = sum((side + GAP) ** 2 for side in sides)
    width = max(sides[0] + GAP, float(np.sqrt(area * ASPECT)))
    x = y = high = 0.0
    found = []
    for side in sides:
        if x > 0 and x + side + GAP > 1.05 * width:
            x, y, high = 0.0, y + high, 0.0
        found.append((x, y))
        x, high = x + side + GAP, max(high, side + GAP)
    return np.array(found)


def _springs(where: Array, pairs: Indices) -> Array:
    """Places (N, 2) in the unit square, from those given and the pairs (M, 2) of linked ones."""
    near = 1 / np.sqrt(len(where))
    for step in range(STEPS if len(where) > 2 else 0):
        apart = where[:, None] - where[None]
        lengths = np.maximum(np.linalg.norm(apart, axis=2), 1e-3 * near)
        push = (apart / lengths[..., None] ** 2 * near**2).sum(axis=1)
        gap = where[pairs[:, 0]] - where[pairs[:, 1]]
        pull = gap * np.linalg.norm(gap, axis=1)[:, None] / near
        np.add.at(push, pairs[:, 0], -pull)
        np.add.at(push, pairs[:, 1], pull)
        length = np.maximum(np.linalg.norm(push, axis=1, keepdims=True), 1e-12)
        where = where + push / length * np.minimum(length, FIRST * (1 - step / STEPS))
    return _filled(where)


def _filled(where: Array) -> Array:
    """The places stretched to the unit square; what has no extent is in its middle."""
    low, high = where.min(axis=0), where.max(axis=0)
    wide = high > low
    found: Array = np.where(wide, (where - low) / np.where(wide, high - low, 1), 0.5)
    return found


def _start(names: Sequence[str], start: Mapping[str, Array]) -> Array:
    """The places seen from the side that shows them widest, in the unit square."""
    rows = np.linspace(0.05, 0.95, max(len(names), 2))[: len(names)]
    where = np.column_stack([rows, np.full(len(names), 0.95)])
    known = [k for k, name in enumerate(names) if name in start]
    if len(known) > 1:
        points = np.array([start[names[k]] for k in known])
        points = points - points.mean(axis=0)
        axes = np.linalg.svd(points, full_matrices=False)[2][:2]
        axes *= np.sign(axes[np.arange(len(axes)), np.abs(axes).argmax(axis=1)])[:, None]
        flat = points @ axes.T
        wide = np.ptp(flat, axis=0).max() or 1.0
        where[known] = 0.5 + 0.8 * flat / wide
    # No two at one place: nothing would drive them apart.
    turn = 2.399963 * np.arange(len(names))
    found: Array = where + 1e-3 * np.column_stack([np.cos(turn), np.sin(turn)])
    return found
