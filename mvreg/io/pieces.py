"""Files read piece by piece: what a scan of which only a part is held needs no memory for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, Any, TypeVar

import numpy as np

from mvreg.io.cloud import PointCloud
from mvreg.kernels.text import parse_rows
from mvreg.types import Array
from mvreg.types.attributes import Values

Item = TypeVar("Item")

#: What may be left at the end of a text.
NOTHING = b" \t\r\n\0\x1a"
#: Rows of a piece, of a file in bytes; and bytes of a piece of a text.
ROWS, BYTES = 1 << 17, 1 << 22
#: Bytes in which a header is looked for. As many are taken for a short file, too, by each thread.
HEAD = 1 << 16


class NotInPiecesError(Exception):
    """A file cannot be read in pieces, or not without a closer look: to be read whole."""


@dataclass(eq=False)
class Pieces:
    """One scan of a file, piece by piece.

    Parameters
    ----------
    read : callable
        ``read(path)`` reads all pieces of the file, wherever it is, in order, NaN included, with
        their attributes; it may be called once `clouds` is at its end. The pieces raise
        `NotInPiecesError` where the file turns out to be damaged or odd: read whole, it says what
        is wrong.
    path : Path
    count : int
        Points that there are, about.
    view_point : (3,) array, optional
    name : str
    T_world_scan : (4, 4) array, optional
        As of a `PointCloud`.
    kinds : mapping of str to dtype
        Of the attributes that the whole scan has, once all pieces are read.
    remarks : list of str
        As of a `PointCloud`, once all pieces are read.
    alone : bool
        The file has no other scan, and is not unpacked first: it may as well be read whole.
    finish : callable, optional
        What `clouds`, or all of them in one, become once all have been seen; None where they come
        without their attributes.
    clouds : iterator of PointCloud
        The pieces for the first time.
    """

    read: Callable[[Path], Iterator[PointCloud]]
    path: Path
    count: int
    view_point: Array | None = None
    name: str = ""
    T_world_scan: Array | None = None
    kinds: dict[str, np.dtype[Any]] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    alone: bool = True
    finish: Callable[[PointCloud], PointCloud] | None = None
    clouds: Iterator[PointCloud] = field(init=False)

    def __post_init__(self) -> None:
        self.clouds = self._noticed()

    def again(self) -> Iterator[PointCloud]:
        """All pieces once more, with the attributes `kinds`."""
        return quietly_each(self.read(self.path))

    def _noticed(self) -> Iterator[PointCloud]:
        for cloud in self.again():
            self.add_kinds(cloud.attributes)
            yield cloud

    def add_kinds(self, attributes: Mapping[str, Values]) -> None:
        """Take notice of the attributes of a piece: the types hold the values of all pieces."""
        for name, values in attributes.items():
            known = self.kinds.get(name, values.dtype)
            self.kinds[name] = np.result_type(known, values.dtype)

    def at_end(self, end: Callable[[int], None]) -> None:
        """Let ``end(count)`` be called when `clouds` is at its end, after so many points."""
        self.clouds = self._ending(self.clouds, end)

    @staticmethod
    def _ending(clouds: Iterator[PointCloud], end: Callable[[int], None]) -> Iterator[PointCloud]:
        count = 0
        for cloud in clouds:
            count += len(cloud.points)
            yield cloud
        end(count)

    def whole(self) -> PointCloud:
        """All of the scan, NaN included, of which no piece has been taken yet."""
        if self.finish is None:
            for _ in self.clouds:
                pass
            return self.whole_again()
        return self._with_all(self.finish(joined([*self.clouds])))

    def whole_again(self) -> PointCloud:
        """The same, once `clouds` is at its end."""
        return self._with_all(joined([*self.again()]))

    def _with_all(self, cloud: PointCloud) -> PointCloud:
        return replace(
            cloud, view_point=self.view_point, name=self.name, T_world_scan=self.T_world_scan,
            remarks=tuple(self.remarks),
        )  # fmt: skip


def joined(clouds: Sequence[PointCloud]) -> PointCloud:
    """Points and attributes of several pieces, one after the other; no point of none."""
    if not clouds:
        return PointCloud(np.empty((0, 3)))
    points = np.concatenate([cloud.points for cloud in clouds])
    return PointCloud(points, attributes={
        name: np.concatenate([cloud.attributes[name] for cloud in clouds])
        for name in clouds[0].attributes
    })  # fmt: skip


def quietly(function: Callable[..., Any], *given: Any) -> Any:
    """What a call returns, NumPy's warnings off: what is not finite is dropped in the end.

    Not around a ``yield``, or they would be off for whoever asks for the next cloud, too.
    """
    with np.errstate(all="ignore"):
        return function(*given)


def quietly_each(items: Iterator[Item]) -> Iterator[Item]:
    """All items, NumPy's warnings off while each is made."""
    while (item := quietly(next, items, None)) is not None:
        yield item


def text_blocks(stream: IO[bytes]) -> Iterator[bytes]:
    """A text from where the stream is, in blocks of whole lines; without line feeds in one."""
    while block := stream.read(BYTES):
        if not block.endswith(b"\n"):
            block += stream.readline()
        yield block


def text_rows(path: Path, start: int, rows: int, columns: int) -> Iterator[Array]:
    """So many rows of numbers from byte `start` on, and nothing behind them, in tables.

    Raises
    ------
    NotInPiecesError
        If anything else is there, or fewer rows.
    """
    with path.open("rb") as stream:
        stream.seek(start)
        for block in text_blocks(stream):
            table, end = first_rows(block, rows, columns) if rows else (None, 0)
            if block[end:].strip(NOTHING):
                raise NotInPiecesError
            if table is not None:
                rows -= len(table)
                yield table
    if rows:
        raise NotInPiecesError


def first_rows(block: bytes, most: int, columns: int) -> tuple[Array, int]:
    """So many rows of numbers at most, those in a block of whole lines, and where they end.

    Raises
    ------
    NotInPiecesError
        If anything else is there, or nothing.
    """
    rows = min(most, block.count(b"\n") + (not block.endswith(b"\n")))
    parsed = parse_rows(block, 0, rows, columns) if block else None
    if parsed is None:
        raise NotInPiecesError
    return parsed


def byte_rows(path: Path, start: int, rows: int, record: np.dtype[Any]) -> Iterator[Values]:
    """So many records from byte `start` on, and less than one behind them, in tables.

    Raises
    ------
    NotInPiecesError
        If there are more or fewer.
    """
    if not 0 <= path.stat().st_size - start - rows * record.itemsize < record.itemsize:
        raise NotInPiecesError
    with path.open("rb") as stream:
        stream.seek(start)
        for first in range(0, rows, ROWS):
            count = min(ROWS, rows - first)
            table = np.frombuffer(stream.read(count * record.itemsize), record)
            if len(table) < count:
                raise NotInPiecesError
            yield table


def head_of(path: Path) -> bytes:
    """The beginning of a file, which has its header unless that is uncommonly long."""
    with path.open("rb") as stream:
        return stream.read(HEAD)
