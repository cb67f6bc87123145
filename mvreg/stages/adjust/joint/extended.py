"""Normal equations of all poses with two more unknowns a scan: its scale, and how it is bent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.stages.adjust.joint.covariance import CLASSES
from mvreg.stages.adjust.joint.frame import Frame
from mvreg.stages.adjust.joint.normal_equations import weight
from mvreg.stages.adjust.joint.rows import Residuals, Rows
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.types import Array, Indices
from mvreg.types.lazy import lazy

#: Unknowns of a scan: its pose, its scale, and how much it is bent.
SCALE, BEND, ALL = 6, 7, 8
#: Columns of a contact: its pose, what turns a scale about one middle into that about another, and
#: the bends of both scans. The unknowns of both are combinations of these.
SHARED, COLUMNS = 6, 9
#: A scan is seen from one side if its normals have a mean as long as this: others cannot be bent.
ONE_SIDED = 0.4


class Shape:
    """What a scan would look like if its scale were off, or if it were bent."""

    def __init__(self, surface: Surface) -> None:
        self.middle = surface.points.mean(axis=0)
        apart = surface.points - self.middle
        self.size = float(np.sqrt((apart**2).sum(axis=1).mean())) or 1.0
        towards = surface.normals.mean(axis=0)
        self.one_sided = surface.oriented and float(np.linalg.norm(towards)) > ONE_SIDED
        self.out = towards / (float(np.linalg.norm(towards)) or 1.0)
        self._samples = apart

    def moved(self, kind: str) -> float:
        """How far a pattern of one moves the samples, in the root mean square (length)."""
        if kind == "scale":
            return self.size
        return float(across(self._samples.T, self.out).std()) / self.size


def across(apart: Array, out: Array) -> Array:
    """Squared distances (M,) of points (3, M) from the line along `out` (3,) through zero."""
    found: Array = (apart**2).sum(axis=0) - (out @ apart) ** 2
    return found


@dataclass(frozen=True, eq=False)
class Sums:
    """Normal equations (8 N, 8 N), their gradient (N, 8), and that of each class (G, N, 8).

    `residuals` (M,) are those that they are of.
    """

    normal: Array
    gradient: Array
    modes: Array
    residuals: Array


@dataclass(frozen=True, eq=False)
class Extended:
    """Residuals, and how they change with the unknowns (N, 8) of all scans.

    Nothing that has a row for each contact is kept: columns are made for one way at a time.

    Parameters
    ----------
    found : Rows or Residuals
    shapes : sequence of Shape
    motions : (N, 4, 4) array
    frame : Frame
        Poses are in its units; a scale is a share, about the scan's middle.
    """

    found: Rows | Residuals
    shapes: Sequence[Shape]
    motions: Array
    frame: Frame

    def sums(
        self, values: Array, width: float, graded: Sequence[Callable[[Rows], Indices]] = ()
    ) -> Sums:
        """What the residuals come to with the unknowns at `values` (N, 8), to first order.

        Weighted by the contacts' weights times the kernel's, and by the classes of each kind in
        `graded`, one kind after another.
        """
        tiles = self.found.in_tiles(lambda tile: self._tile_sums(tile, values, width, graded))
        normal, along, residuals = (np.concatenate(column) for column in zip(*tiles, strict=True))
        blocks, slopes = normal.reshape(-1, 2, ALL, 2, ALL), along.reshape(len(along), -1, 2, ALL)
        return Sums(*self._assembled(blocks, slopes), residuals)

    def _tile_sums(
        self, tile: Rows, values: Array, width: float, graded: Sequence[Callable[[Rows], Indices]]
    ) -> tuple[Array, Array, Array]:
        """Of each way (16, 16), and with the residuals and each class (., 16); the residuals."""
        weights, residuals, ends = tile.weights, tile.residuals.copy(), tile.contacts.ends
        groups, labels = [one(tile) for one in graded], np.arange(CLASSES)[:, None]
        normal, along = [], []
        for k, (source, target) in enumerate(tile.contacts.ways):
            rows = slice(ends[k], ends[k + 1])
            columns = self._columns(tile, rows, source, target)
            change = self._change(source, target)
            mine = residuals[rows]
            mine += (change @ values[[source, target]].ravel()) @ columns
            weighted = columns * (weights[rows] * weight(mine, width))
            by_class = [((one[rows] == labels) * mine) @ weighted.T for one in groups]
            along.append(np.vstack([weighted @ mine, *by_class]) @ change)
            normal.append(change.T @ (weighted @ columns.T) @ change)
        return np.stack(normal), np.stack(along), residuals

    def _assembled(self, blocks: Array, along: Array) -> tuple[Array, Array, Array]:
        """The sums of all, from those of each way, (W, 2, 8, 2, 8) and (W, 1 + G, 2, 8)."""
        count, places = len(self.shapes), self.found.contacts.ways
        normal = np.zeros((count, count, ALL, ALL))
        slopes = np.zeros((count, along.shape[1], ALL))
        for a in range(2):
            np.add.at(slopes, places[:, a], along[:, :, a])
            for b in range(2):
                np.add.at(normal, (places[:, a], places[:, b]), blocks[:, a, :, b])
        size, each = count * ALL, slopes.swapaxes(0, 1)
        whole = normal.swapaxes(1, 2).reshape(size, size)
        return whole, each[0], each[1:]

    def _columns(self, tile: Rows, rows: slice, source: int, target: int) -> Array:
        """(9, m), see `COLUMNS`: one after the other in memory."""
        made = np.empty((COLUMNS, rows.stop - rows.start))
        made[:SHARED] = tile.jacobian[rows].T
        points, normals = np.ascontiguousarray(tile.points[rows].T), made[3:SHARED]
        made[SHARED] = (normals * points).sum(axis=0)
        for column, k in ((SHARED + 1, source), (SHARED + 2, target)):
            shape = self.shapes[k]
            if shape.one_sided:
                out = self.motions[k, :3, :3] @ shape.out
                bent = across(points - self._middles[k][:, None], out)
                bent *= out @ normals
                made[column] = bent * (self.frame.radius / shape.size)
            else:
                made[column] = 0.0
        return made

    def _change(self, source: int, target: int) -> Array:
        """(9, 16): the columns' combinations that the unknowns of source and target are."""
        change = np.zeros((COLUMNS, 2, ALL))
        for end, (k, sign) in enumerate(((source, 1.0), (target, -1.0))):
            change[:6, end, :6] = sign * np.eye(6)
            change[3:6, end, SCALE] = -sign * self._middles[k]
            change[SHARED, end, SCALE] = sign
            change[SHARED + 1 + end, end, BEND] = sign
        return change.reshape(COLUMNS, 2 * ALL)

    @lazy
    def _middles(self) -> Array:
        """(N, 3): the middles of the scans, in units of the frame."""
        middles = np.stack([shape.middle for shape in self.shapes])
        placed = np.einsum("nij,nj->ni", self.motions[:, :3, :3], middles) + self.motions[:, :3, 3]
        found: Array = (placed - self.frame.centre) / self.frame.radius
        return found
