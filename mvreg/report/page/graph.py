"""Where the nodes of the view graph are drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mvreg.types import Array

#: Steps of the layout, and the share of the drawing that a node moves by at first.
STEPS, FIRST = 150, 0.1


def layout(
    names: Sequence[str], links: Sequence[tuple[str, str]], start: Mapping[str, Array]
) -> dict[str, tuple[float, float]]:
    """Positions in the unit square: linked scans near each other, none on another.

    Springs and charges (Fruchterman and Reingold 1991) from the places that the scans have in the
    model, seen from the side that shows them widest; the same each time.

    Parameters
    ----------
    names : sequence of str
    links : sequence of pairs of names
    start : mapping of str to (3,) array
        Where each scan is; those that are missing begin in a row below.
    """
    count = len(names)
    if not count:
        return {}
    place = {name: k for k, name in enumerate(names)}
    where = _start(names, start)
    pairs = np.array([(place[a], place[b]) for a, b in links], dtype=np.intp).reshape(-1, 2)
    near = 1 / np.sqrt(count)
    for step in range(STEPS):
        apart = where[:, None] - where[None]
        lengths = np.maximum(np.linalg.norm(apart, axis=2), 1e-3 * near)
        push = (apart / lengths[..., None] ** 2 * near**2).sum(axis=1)
        gap = where[pairs[:, 0]] - where[pairs[:, 1]]
        pull = gap * np.linalg.norm(gap, axis=1)[:, None] / near
        np.add.at(push, pairs[:, 0], -pull)
        np.add.at(push, pairs[:, 1], pull)
        push -= 0.5 * (where - 0.5)  # parts that nothing links stay in the picture
        length = np.maximum(np.linalg.norm(push, axis=1, keepdims=True), 1e-12)
        where = where + push / length * np.minimum(length, FIRST * (1 - step / STEPS))
    low, high = where.min(axis=0), where.max(axis=0)
    where = (where - low) / np.where(high > low, high - low, 1) if count > 1 else where * 0 + 0.5
    return {name: (float(x), float(y)) for name, (x, y) in zip(names, where, strict=True)}


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
