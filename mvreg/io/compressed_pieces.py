"""The scans in large compressed files, piece by piece, from files unpacked as long as they last."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.formats import Format, ReadOptions, format_of
from mvreg.io.pieces import NotInPiecesError, Pieces
from mvreg.io.unpacked import (
    DAMAGED,
    gunzipped,
    members_of,
    name_in,
    remark_on,
    shown_name,
    unzipped,
)

#: Compressed files of fewer bytes are read whole: what is in them is not large.
WORTH = 1 << 22


def pieces_of_gz(
    path: Path, options: ReadOptions, formats: Mapping[str, Format]
) -> Iterator[Pieces]:
    """The scans in a compressed file.

    Raises
    ------
    NotInPiecesError
        If it is small, or has to be read whole.
    """
    _check(path)
    yield from _inside(path, gunzipped, format_of(path.with_suffix(""), formats), options)


def pieces_of_zip(
    path: Path, options: ReadOptions, formats: Mapping[str, Format]
) -> Iterator[Pieces]:
    """The scans of all members of an archive; their names once those of a member are read.

    Raises
    ------
    NotInPiecesError
        If it is small, or any member has to be read whole.
    """
    _check(path)
    with _zip(path) as archive:
        members, others = members_of(archive, formats)
    remarks = remark_on(others)
    for member in members:
        unpack = partial(_member, member)
        inner = formats[name_in(member).suffix.lower()]
        found: list[Pieces] = []
        for pieces in _inside(path, unpack, inner, options):
            found.append(pieces)
            pieces.at_end(partial(_say, pieces, remarks))
            remarks = []
            yield pieces
        for pieces in found:
            pieces.name = shown_name(member, pieces.name, len(found))


def _say(pieces: Pieces, remarks: list[str], count: int) -> None:
    pieces.remarks = [*pieces.remarks, *remarks]


def _check(path: Path) -> None:
    if path.stat().st_size < WORTH:
        raise NotInPiecesError


@contextmanager
def _member(member: zipfile.ZipInfo, path: Path) -> Iterator[Path]:
    with _zip(path) as archive, unzipped(archive, member, path) as file:
        yield file


@contextmanager
def _zip(path: Path) -> Iterator[zipfile.ZipFile]:
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except DAMAGED as error:
        raise NotInPiecesError from error


def _inside(
    path: Path,
    unpack: Callable[[Path], AbstractContextManager[Path]],
    inner: Format,
    options: ReadOptions,
) -> Iterator[Pieces]:
    """The scans in what a compressed file unpacks to; it is unpacked again to read one again."""
    if inner.pieces is None:
        raise NotInPiecesError
    with unpack(path) as file:
        for pieces in inner.pieces(file, options):
            pieces.alone = False
            yield pieces
            # Only now: until here the file is still there.
            pieces.path, pieces.read = path, partial(_again, pieces.read, unpack)


def _again(
    read: Callable[[Path], Iterator[PointCloud]],
    unpack: Callable[[Path], AbstractContextManager[Path]],
    path: Path,
) -> Iterator[PointCloud]:
    with unpack(path) as file:
        try:
            yield from read(file)
        except InputError as error:
            raise InputError(str(error).replace(str(file), str(path))) from error
