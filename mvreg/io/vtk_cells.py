"""The cells of VTK's files cut into triangles, and what is said of those that have no surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError, few
from mvreg.types.attributes import Values

LINES, STRIP, POLYGON = 4, 6, 7
#: Cells with a surface, and how many of their corners, the first ones, make its outline: None for
#: all of them. Others of quadratic cells lie between these.
_FACES: Mapping[int, int | None] = {5: 3, POLYGON: None, 8: 4, 9: 4, 22: 3, 23: 4, 28: 4, 34: 3}
#: Corners of a pixel come row by row.
_PIXEL = 8
#: Cells without one that are no loss: there is nothing, or a point.
_POINTS = (0, 1, 2)
_NAMES = {3: "lines", LINES: "lines", 10: "tetrahedra", 11: "voxels", 12: "hexahedra",
          13: "wedges", 14: "pyramids", 42: "polyhedra"}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of points.

    Parameters
    ----------
    corners : (C,) integer array
        Indices of points, of one cell after the other.
    ends : (M,) integer array
        Where in `corners` each cell ends.
    kinds : (M,) integer array or int
        VTK's numbers of their types.
    """

    corners: Values
    ends: Values
    kinds: Values | int

    def checked(self, points: int, where: str) -> Cells:
        """The same.

        Raises
        ------
        InputError
            If the cells do not end one after the other, at the last of the corners, or if these
            are not among so many points.
        """
        ends = self.ends
        good = len(ends) == 0 or (ends[0] >= 0 and ends[-1] == len(self.corners))
        if not good or np.any(np.diff(ends) < 0):
            raise InputError(
                f"{where}: expected cells that end one after the other, at {len(self.corners)} "
                f"corners, got ends {ends[:3].tolist()} to {ends[-1:].tolist()}; it is damaged"
            )
        if not isinstance(self.kinds, int) and len(self.kinds) != len(ends):
            raise InputError(
                f"{where}: expected the types of {len(ends)} cells, got {len(self.kinds)}"
            )
        outside = self.corners[(self.corners < 0) | (self.corners >= points)]
        if len(outside):
            raise InputError(
                f"{where}: expected corners 0 to {points - 1}, got {outside[0]}; it is damaged"
            )
        return self


def counted(values: Values, count: int, where: str) -> tuple[Values, Values]:
    """Corners and ends from a list of `count` cells, each its number of corners and these.

    Raises
    ------
    InputError
        If the numbers lead past the end of the list, or not to it.
    """
    numbers = values.astype(np.int64)
    sizes = numbers[:1].tolist()
    if sizes and len(numbers) == count * (sizes[0] + 1):
        table = numbers.reshape(count, -1)
        if np.all(table[:, 0] == sizes[0]):  # all alike, as most meshes have them
            return table[:, 1:].reshape(-1), np.arange(1, count + 1) * sizes[0]
    starts: list[int] = []
    listed, at = numbers.tolist(), 0
    while len(starts) < count and at < len(listed) and listed[at] >= 0:
        starts.append(at)
        at += 1 + listed[at]
    if len(starts) < count or at != len(listed):
        raise InputError(
            f"{where}: expected {count} cells in {len(listed)} numbers, found {len(starts)} in "
            f"{at}; the file is damaged"
        )
    kept = np.ones(len(numbers), dtype=bool)
    kept[starts] = False
    return numbers[kept], np.cumsum(numbers[starts])


def triangles(cells: Cells) -> Values:
    """Triangles (T, 3) of all cells that have a surface, polygons from their first corner."""
    starts = np.concatenate([[0], cells.ends[:-1]]) if len(cells.ends) else cells.ends
    sizes = cells.ends - starts
    kinds = np.broadcast_to(cells.kinds, sizes.shape)
    parts = [np.empty((0, 3), dtype=np.int64)]
    for kind in np.unique(kinds).tolist():
        if kind not in _FACES and kind != STRIP:
            continue
        most = _FACES.get(kind)
        for size in np.unique(sizes[kinds == kind]).tolist():
            first = starts[(kinds == kind) & (sizes == size)]
            used = size if most is None else min(size, most)
            table = cells.corners[first[:, None] + np.arange(used)].astype(np.int64)
            parts += _cut(table, kind)
    return np.concatenate(parts)


def _cut(table: Values, kind: int) -> list[Values]:
    """Triangles of cells (M, K) of one kind with as many corners each."""
    if kind == _PIXEL and table.shape[1] == 4:
        table = table[:, [0, 1, 3, 2]]
    last = table.shape[1] - 1
    if kind != STRIP:
        return [table[:, [0, i, i + 1]] for i in range(1, last)]
    return [table[:, [i, i + 1 + i % 2, i + 2 - i % 2]] for i in range(last - 1)]


def surface(lists: Sequence[Cells]) -> tuple[Values | None, list[str]]:
    """Triangles (T, 3) of all cells, None where there are none, and what is said of the others."""
    lost: dict[str, int] = {}
    for cells in lists:
        kinds, counts = np.unique(
            np.broadcast_to(cells.kinds, cells.ends.shape), return_counts=True
        )
        for kind, count in zip(kinds.tolist(), counts.tolist(), strict=True):
            if kind not in (*_FACES, STRIP, *_POINTS):
                name = _NAMES.get(kind, f"cells of type {kind}")
                lost[name] = lost.get(name, 0) + count
    told = few([f"{count:,} {name}" for name, count in lost.items()])
    remarks = [f"left out what has no surface: {told}"] if lost else []
    faces = [found for cells in lists if len(found := triangles(cells))]
    return (np.concatenate(faces) if faces else None), remarks
