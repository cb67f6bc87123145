"""Read E57 files through libe57, as pye57 brings it.

Not through pye57's own functions: those of 0.4.19 refuse colours of 16 bits and row indices beyond
16 bits, take poses by the order of their parts, and fail where an optional field is missing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.e57_columns import SeenColumns
from mvreg.io.e57_header import ScanHeader, check_size, scan_header
from mvreg.io.pieces import NotInPiecesError, Pieces
from mvreg.types.attributes import Values

#: Points at a time: what is made of a header that lies stays small.
CHUNK = 100_000
#: libe57 reads XML by a library with state of its own: one thread at a time, call by call. A thread
#: that has it may take it again: the garbage collector may close a scan that was left half read.
_ONE = RLock()


def read_e57(path: Path) -> Iterator[PointCloud]:
    """Read the scans of a file, in double precision, each in its own frame, with its pose.

    Points with an invalid state are left out, with a remark. The sensor is at the origin of a
    scan's frame where the file has it as a scanner saw it: in spherical coordinates, by row and
    column, or with a pose other than the identity, which writers write regardless. The format
    does not say whether a scanner was levelled.

    Raises
    ------
    InputError
        With file, byte or scan, and reason; where pye57 is not installed, how to install it.
    """
    empty: list[str] = []
    for pieces in _scans(path):
        cloud = pieces.whole()
        if not len(cloud.points):
            empty.append(cloud.name)
            continue
        yield replace(cloud, remarks=(*cloud.remarks, *_without(empty)))
        empty = []


def e57_pieces(path: Path) -> Iterator[Pieces]:
    """The same scans, each piece by piece.

    Raises
    ------
    NotInPiecesError
        If all points of a scan turn out to be invalid.
    """
    empty: list[str] = []
    for pieces in _scans(path):
        if not pieces.count:
            empty.append(pieces.name)
            continue
        pieces.at_end(partial(_check_points, pieces, empty))
        yield pieces
        empty = []


def _check_points(pieces: Pieces, empty: Sequence[str], count: int) -> None:
    if not count:
        raise NotInPiecesError
    pieces.remarks += _without(empty)


def _without(empty: Sequence[str]) -> list[str]:
    return [f"scans without points left out: {', '.join(empty)}"] if empty else []


def _scans(path: Path) -> Iterator[Pieces]:
    """All scans of a file, those without points, too."""
    check_size(path)
    with _opened(path) as (libe57, image):
        with _said(path), _ONE:
            nodes = image.root()["data3D"]
            count = len(nodes)
        for index in range(count):
            with _said(path), _ONE:
                header = scan_header(libe57, nodes[index], index, path)
            yield _scan(libe57, image, header, path)


def _scan(libe57: Any, image: Any, header: ScanHeader, path: Path) -> Pieces:
    """One scan, for the first time through an image that is open."""
    seen = SeenColumns(header)

    def again(path: Path) -> Iterator[PointCloud]:
        with _opened(path) as (libe57, image):
            for columns in _columns(libe57, image, header, path):
                yield seen.finished(seen.cloud_of(columns))

    def first() -> Iterator[PointCloud]:
        invalid = 0
        for columns in _columns(libe57, image, header, path):
            cloud = seen.cloud_of(columns)
            seen.add(cloud)
            invalid += len(columns[header.axes[0]]) - len(cloud.points)
            yield cloud
        if invalid:
            found.remarks.append(
                f"{invalid:,} of {header.count:,} points without a return left out"
            )
        nothing = {field: np.empty(0) for field in header.fields}
        found.add_kinds(seen.finished(seen.cloud_of(nothing)).attributes)

    found = Pieces(
        again, path, header.count, header.view_point, header.name, header.pose,
        remarks=[*header.remarks], alone=False, finish=seen.finished,
    )  # fmt: skip
    found.clouds = first()
    return found


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, Any]]:
    """The library and a file."""
    try:
        from pye57 import libe57
    except ImportError as error:
        raise InputError(
            f"{path}: E57 files are read through pye57, which is not installed; "
            "pip install 'mvreg[e57]'"
        ) from error
    with _said(path), _ONE:
        image = libe57.ImageFile(str(path), "r")
    try:
        yield libe57, image
    finally:
        with _ONE:
            image.close()


@contextmanager
def _said(path: Path) -> Iterator[None]:
    """Whatever is raised meanwhile told as of the file."""
    try:
        yield
    except (InputError, OSError, MemoryError):
        raise
    except Exception as error:  # libe57 and NumPy raise as they please
        reason = str(error).strip().split("\n")[0] or type(error).__name__
        raise InputError(f"{path}: not a readable E57 file: {reason}") from error


def _columns(
    libe57: Any, image: Any, header: ScanHeader, path: Path
) -> Iterator[dict[str, Values]]:
    """Columns by field, in pieces, all as doubles, which hold integers up to 2**53 exactly."""
    if not header.count:
        return
    size, found = min(header.count, CHUNK), 0
    columns = {field: np.empty(size) for field in header.fields}
    with _said(path), _ONE:
        buffers = libe57.VectorSourceDestBuffer()
        for field, column in columns.items():
            buffers.append(libe57.SourceDestBuffer(image, field, column, size, True, True))
        reader = image.root()["data3D"][header.index]["points"].reader(buffers)
    try:
        while found <= header.count:
            with _said(path), _ONE:
                more = int(reader.read())
            if not more:
                break
            found += more
            yield {field: column[:more].copy() for field, column in columns.items()}
    finally:
        with _said(path), _ONE:
            reader.close()
    if found != header.count:
        raise InputError(
            f"{path}, scan {header.name!r}: {header.count} points are announced, but {found} could "
            "be read"
        )
