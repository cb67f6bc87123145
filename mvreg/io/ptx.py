"""Read PTX files: gridded scans, each in its scanner's frame, with its pose."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mvreg.io.cloud import PointCloud
from mvreg.io.pts import attributes
from mvreg.io.rigid import FINE, nearest_rigid
from mvreg.io.stations import Lines, with_points
from mvreg.types import Array

_COUNT = re.compile(r"\s*(\d{1,9})\s*")


def read_ptx(path: Path) -> Sequence[PointCloud]:
    """Read the scans of a file.

    The 4x4 matrix of a header is for row vectors, with the translation in its last row; its
    transpose is the scan's pose, from the scanner's frame to the world. One with the translation
    in its last column, as some programs write it, is taken as it is, with a remark; one that is no
    rigid motion is left out, with a remark. The header's position of the scanner is in the world.
    Where it and the matrix say the same, as they should, the scanner is at the origin of its
    frame; where the points are in the world already, at the position. A position of 0, 0, 0 says
    nothing: the scanner is at the origin.

    Cells of the grid without a return, written as ``0 0 0``, are left out, with a remark. The
    format does not say whether a scanner was levelled.

    Raises
    ------
    InputError
        With file, line and reason; also where a scan has fewer or more rows than its header says.
    """
    lines = Lines.of(path)
    clouds: list[PointCloud] = []
    while lines.skip_blank():
        clouds.append(_scan(lines, f"scan{len(clouds) + 1}"))
    if not clouds:
        raise lines.error("a PTX header, beginning with the number of columns")
    if len(clouds) == 1:
        clouds = [replace(clouds[0], name="")]
    return with_points(clouds, path)


@dataclass(frozen=True, eq=False)
class PtxHeader:
    """What is said of a scan: its cells, the view point (3,) and the pose (4, 4) if there are."""

    cells: int
    view_point: Array | None
    pose: Array | None
    remarks: tuple[str, ...]


def read_header(lines: Lines) -> PtxHeader:
    """Read the header of a scan, and go on to its points.

    Raises
    ------
    InputError
        With file, line and reason.
    """
    columns = _count(lines, "the number of columns of a scan")
    rows = _count(lines, "the number of rows of a scan")
    position = _numbers(lines, 3, "the scanner's position")
    for _ in range(3):
        _numbers(lines, 3, "an axis of the scanner")
    matrix = np.array([_numbers(lines, 4, "a row of the 4x4 matrix") for _ in range(4)])
    pose, remarks = _pose(matrix)
    return PtxHeader(columns * rows, _view_point(np.array(position), pose), pose, remarks)


def row_length(lines: Lines) -> int:
    """How many numbers the rows of a scan have.

    Raises
    ------
    InputError
        If the row at hand has neither intensity nor colours, nor is without them.
    """
    columns = len(lines.peek().split())
    if columns not in (3, 4, 6, 7):
        raise lines.error("a row 'x y z intensity' or 'x y z intensity red green blue'")
    return columns


def without_return(missing: int, cells: int) -> tuple[str, ...]:
    """What is said of cells without a return."""
    return (f"{missing:,} of {cells:,} cells without a return left out",) if missing else ()


def _scan(lines: Lines, name: str) -> PointCloud:
    header = read_header(lines)
    if not header.cells:
        return PointCloud(np.empty((0, 3)), name=name)
    table = lines.table(header.cells, row_length(lines))
    back = np.any(table[:, :3] != 0, axis=1)
    missing = len(back) - int(np.count_nonzero(back))
    if missing:
        table = table[back]
    return PointCloud(
        table[:, :3], header.view_point, attributes(table), name, header.pose,
        remarks=(*header.remarks, *without_return(missing, header.cells)),
    )  # fmt: skip


def _count(lines: Lines, expected: str) -> int:
    count = _COUNT.fullmatch(lines.peek())
    if count is None:
        raise lines.error(expected)
    lines.next()
    return int(count[1])


def _numbers(lines: Lines, count: int, what: str) -> list[float]:
    try:
        numbers = [float(word) for word in lines.peek().split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise lines.error(f"{what}, {count} numbers")
    lines.next()
    return numbers


def _pose(matrix: Array) -> tuple[Array | None, tuple[str, ...]]:
    """The pose of a scan, made exactly rigid, and what is odd about it."""
    by_column = bool(np.any(matrix[:3, 3] != 0) and not np.any(matrix[3, :3] != 0))
    found = matrix if by_column else matrix.T
    left_out = "its 4x4 matrix is no rigid motion and was left out"
    if np.any(found[3] != [0, 0, 0, 1]):
        return None, (left_out,)
    try:
        rigid, deviation = nearest_rigid(found)
    except ValueError:
        return None, (left_out,)
    pose = found.copy() if np.array_equal(found[:3, :3], np.eye(3)) else rigid
    remarks = ["its 4x4 matrix has the translation in its last column"] if by_column else []
    if deviation > FINE:
        remarks.append(
            "its 4x4 matrix is no exact rotation, as of few decimals: the nearest one is taken, "
            f"which differs by up to {deviation:.2g} in an entry"
        )
    return pose, tuple(remarks)


def _view_point(position: Array, pose: Array | None) -> Array | None:
    """Where the scanner stood, in the frame of the points."""
    if pose is None:
        return None
    offset = position - pose[:3, 3]
    scale = max(np.abs(position).max(), np.abs(pose[:3, 3]).max())
    if not position.any() or np.abs(offset).max() <= 1e-5 * scale:
        return np.zeros(3)
    return np.asarray(pose[:3, :3].T @ offset)
