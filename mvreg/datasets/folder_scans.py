"""The scans in files: all that each file says of them, and which files hold none."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from mvreg.datasets.large import StoredPoints, held, thinned
from mvreg.datasets.no_returns import without_zeros
from mvreg.errors import InputError, NoScanError
from mvreg.io import (
    Format,
    NotInPiecesError,
    Pieces,
    PointCloud,
    ReadOptions,
    iterate_clouds,
    open_pieces,
    whole_scan,
)
from mvreg.parallel import in_threads
from mvreg.types import Array, Scan

#: A scan of fewer points than this, and than this share of those of a typical one, is no scan but
#: a matrix, a list of targets or of positions.
HANDFUL, SHARE = 1000, 0.02


@dataclass(frozen=True)
class Reader:
    """How files are read.

    Parameters
    ----------
    folder : Path
    options : ReadOptions
    formats : mapping of str to Format
        By suffix.
    most : int
        Points held of a scan, 0 for all.
    """

    folder: Path
    options: ReadOptions
    formats: Mapping[str, Format]
    most: int


@dataclass(frozen=True)
class ReadScan:
    """A scan as read, how many of its points were `dropped`, and what its file says besides.

    `source` is the file, and the scan's position in it, from 0.
    """

    scan: Scan
    dropped: int
    remarks: tuple[str, ...]
    initial: Array | None
    source: tuple[Path, int]


@dataclass(frozen=True)
class ReadFiles:
    """The scans of all files, in order, and why the others were left out."""

    scans: tuple[ReadScan, ...]
    left_out: Mapping[str, str]


def read_all(files: Sequence[str], reader: Reader) -> ReadFiles:
    """Read every file, and report all that cannot be read at once.

    Files that hold no scans, notes or poses, and those of a handful of points are left out where
    others hold some.

    Raises
    ------
    InputError
        If any file cannot be read, or none holds scans.
    """
    found = in_threads(lambda name: _read(name, reader), files)
    scans = [scan for each in found if isinstance(each, tuple) for scan in each]
    passed_over = NoScanError if len(scans) >= 2 else ()
    errors = [each for each in found if isinstance(each, InputError)]
    bad = [each for each in errors if not isinstance(each, passed_over)]
    if bad:
        raise InputError(
            "\n".join([
                f"{len(bad)} of {len(files)} files cannot be read; repair or remove them, or "
                "leave them out by dataset.pattern:", *(f"  {each}" for each in bad),
            ])
        )  # fmt: skip
    left_out = {
        name: _reason(each)
        for name, each in zip(files, found, strict=True)
        if isinstance(each, NoScanError)
    }
    typical = _typical([len(each.scan.points) for each in scans])
    kept = []
    for each in scans:
        count = len(each.scan.points)
        if count < min(HANDFUL, SHARE * typical):
            left_out[each.scan.name] = f"only {count} points"
        else:
            kept.append(each)
    return ReadFiles(tuple(kept), left_out)


def _reason(error: NoScanError) -> str:
    """Why a file holds no scan, without its name and what to do."""
    told = re.sub(r"^.*?: (expected points, found )?", "", str(error), count=1)
    return told.removesuffix("; leave this file out")


def _typical(counts: list[int]) -> float:
    """The size of the scan that a typical point is in: many small ones do not change it."""
    ordered = np.sort(np.array(counts, dtype=np.int64))
    if not len(ordered):
        return 0.0
    return float(ordered[np.searchsorted(np.cumsum(ordered), ordered.sum() / 2)])


def _read(name: str, reader: Reader) -> tuple[ReadScan, ...] | InputError:
    path = reader.folder / name
    if (in_pieces := _in_pieces(name, path, reader)) is not None:
        return in_pieces
    try:
        # One at a time: of a large scan only a part is held.
        found = [
            (cloud.name, _scan(name, cloud, index, path, reader))
            for index, cloud in enumerate(iterate_clouds(path, reader.options, reader.formats))
        ]
        return _named(name, found)
    except InputError as error:
        return error


def _named(file: str, found: Sequence[tuple[str, ReadScan]]) -> tuple[ReadScan, ...]:
    """The scans of a file, which come with the names that it has for them, under ours."""
    names = _names(file, [own for own, _ in found])
    return tuple(
        replace(each, scan=replace(each.scan, name=name))
        for name, (_, each) in zip(names, found, strict=True)
    )


def _names(file: str, own: Sequence[str]) -> list[str]:
    """The file's name for its only scan; else with that of the scan, or with its number."""
    if len(own) == 1:
        return [file]
    if all(own) and len(set(own)) == len(own):
        return [f"{file}:{name}" for name in own]
    return [f"{file}:{number}" for number in range(1, len(own) + 1)]


def _in_pieces(name: str, path: Path, reader: Reader) -> tuple[ReadScan, ...] | None:
    """The scans of a file without all of a large one in memory; None where it is read whole."""
    if not reader.most:
        return None
    lasting = path.absolute()  # read again, perhaps from another working directory
    found: list[tuple[Pieces, ReadScan]] = []
    try:
        for pieces in open_pieces(lasting, reader.options, reader.formats):
            scan = _scan_in_pieces(name, pieces, len(found), lasting, reader)
            if scan is None:
                return None
            found.append((pieces, scan))
    except (NotInPiecesError, InputError, OSError, MemoryError):
        return None  # read whole, it says what is wrong
    return _named(name, [(pieces.name, scan) for pieces, scan in found]) or None


def _scan_in_pieces(
    name: str, pieces: Pieces, index: int, path: Path, reader: Reader
) -> ReadScan | None:
    """One scan; None where its file has to be read whole.

    A scan that is not large is not thinned; it is read here where its file may have others, or
    would be unpacked a second time.
    """
    again, large = partial(_again, path, index, reader), pieces.count > reader.most
    if large and (found := thinned(pieces, path, again, reader.most)) is not None:
        return _read_scan(name, found.cloud, found.full, found.dropped, (path, index))
    if pieces.alone:
        return None
    return _scan(name, whole_scan(pieces, begun=large), index, path, reader)


def _again(path: Path, index: int, reader: Reader) -> PointCloud:
    """One scan of a file once more."""
    with closing(iterate_clouds(path, reader.options, reader.formats)) as clouds:
        return without_zeros(next(islice(clouds, index, None)), path)[0]


def _scan(name: str, cloud: PointCloud, index: int, path: Path, reader: Reader) -> ReadScan:
    lasting = path.absolute()
    cloud, dropped = without_zeros(cloud, path)
    kept, full = held(cloud, lasting, partial(_again, lasting, index, reader), reader.most)
    return _read_scan(name, kept, full, dropped, (lasting, index))


def _read_scan(
    name: str, cloud: PointCloud, full: StoredPoints | None, dropped: int, source: tuple[Path, int]
) -> ReadScan:
    scan = Scan(
        name, cloud.points, view_point=cloud.view_point,
        up=np.array([0.0, 0.0, 1.0]) if cloud.levelled else None,
        attributes=cloud.attributes, full=full,
    )  # fmt: skip
    return ReadScan(scan, dropped, cloud.remarks, cloud.T_world_scan, source)
