"""The scans of large PTX and PTS files, piece by piece; only of files as they should be."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.columns import telling_rows
from mvreg.io.pieces import HEAD, NotInPiecesError, Pieces, first_rows, text_blocks
from mvreg.io.pts import COUNT, attributes
from mvreg.io.ptx import read_header, row_length, without_return
from mvreg.io.stations import Lines
from mvreg.io.text import text_pieces
from mvreg.types import Array

Told = TypeVar("Told")


def ptx_pieces(path: Path) -> Iterator[Pieces]:
    """The scans of a file, as `read_ptx` has them.

    Raises
    ------
    NotInPiecesError
        If a scan has no points, or the file is damaged.
    """
    number, at = 1, 0
    while (lines := _lines(path, at)) is not None:
        header = _told(read_header, lines)
        columns = _told(row_length, lines)
        rows = _Rows(at + lines.at, header.cells, columns, zeros=False)
        found = rows.pieces(path, f"scan{number}")
        found.view_point, found.T_world_scan = header.view_point, header.pose
        found.remarks = [*header.remarks]
        yield found
        number, at = number + 1, rows.end


def pts_pieces(path: Path, columns: Sequence[str] = ()) -> Iterator[Pieces]:
    """The stations of a file, as `read_pts` has them; a table without a count as `text_pieces`.

    Raises
    ------
    NotInPiecesError
        If a station has no points, or the file is damaged.
    """
    number, at = 1, 0
    while (lines := _lines(path, at)) is not None:
        count = COUNT.fullmatch(lines.next())
        if count is None and number == 1:
            yield text_pieces(path, columns)
            return
        if count is None or not lines.skip_blank():
            raise NotInPiecesError
        rows = _Rows(at + lines.at, int(count[1]), len(lines.peek().split()))
        yield rows.pieces(path, f"station{number}")
        number, at = number + 1, rows.end


class _Rows:
    """The rows of one scan, from byte `start` on; `end` is where they end, once they are read."""

    def __init__(self, start: int, count: int, columns: int, zeros: bool = True) -> None:
        if not count or columns < 3:
            raise NotInPiecesError
        self.start, self.count, self.columns, self.zeros = start, count, columns, zeros
        self.end = start
        self.telling: list[Array] = []

    def pieces(self, path: Path, name: str) -> Pieces:
        """The scan of a file, named."""
        found = Pieces(
            self.again, path, self.count, name=name, alone=False,
            finish=lambda cloud: self.finished(cloud, np.empty((0, self.columns))),
        )  # fmt: skip
        found.clouds = self.first(found)
        return found

    def first(self, found: Pieces) -> Iterator[PointCloud]:
        """All pieces, their columns as attributes; which of all rows tell what those are, is kept.

        Where points at 0, 0, 0 are cells without a return, they are left out, with a remark.
        """
        back = 0
        for table in self.tables(found.path):
            back += len(table)
            self.telling.append(telling_rows(table))
            yield self.cloud_of(table)
        if not back:
            raise NotInPiecesError
        if not self.zeros:
            found.remarks += without_return(self.count - back, self.count)
        found.add_kinds(attributes(np.concatenate(self.telling)))

    def again(self, path: Path) -> Iterator[PointCloud]:
        """All pieces with the attributes that they have beside the rows that tell."""
        telling = np.concatenate(self.telling)
        for table in self.tables(path):
            yield self.finished(self.cloud_of(table), telling)

    def tables(self, path: Path) -> Iterator[Array]:
        """The rows that count, in tables."""
        left, self.end = self.count, self.start
        with path.open("rb") as stream:
            stream.seek(self.start)
            blocks = text_blocks(stream)
            while left:
                table, size = first_rows(next(blocks, b""), left, self.columns)
                left, self.end = left - len(table), self.end + size
                yield table if self.zeros else table[np.any(table[:, :3] != 0, axis=1)]

    def cloud_of(self, table: Array) -> PointCloud:
        """Points, and the other columns by number."""
        more = {str(column): table[:, column] for column in range(3, self.columns)}
        return PointCloud(np.ascontiguousarray(table[:, :3]), attributes=more)

    def finished(self, cloud: PointCloud, telling: Array) -> PointCloud:
        """The same with attributes as they are beside rows that tell of all the others."""
        count = len(cloud.points)
        table = np.column_stack([cloud.points, *cloud.attributes.values()])
        found = attributes(np.concatenate([table, telling]))
        return replace(cloud, attributes={name: values[:count] for name, values in found.items()})


def _lines(path: Path, at: int) -> Lines | None:
    """The beginning of a scan, from its first line that is not blank; None at the end of a file."""
    with path.open("rb") as stream:
        stream.seek(at)
        data = stream.read(HEAD)
        size = stream.seek(0, 2)
    if at == 0 and b"\n" not in data and b"\r" in data:
        raise NotInPiecesError
    lines = Lines(data, path, at=len(BOM_UTF8) if at == 0 and data.startswith(BOM_UTF8) else 0)
    if lines.skip_blank():
        return lines
    if at + len(data) < size:
        raise NotInPiecesError
    return None


def _told(read: Callable[[Lines], Told], lines: Lines) -> Told:
    """What the beginning of a scan says."""
    try:
        return read(lines)
    except InputError as error:
        raise NotInPiecesError from error
