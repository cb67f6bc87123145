"""What is in compressed files, unpacked into files that last as long as they are read."""

from __future__ import annotations

import gzip
import zipfile
import zlib
from collections.abc import Container, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import IO

from mvreg.errors import InputError, few

#: Text compresses to a fifth at best, zeros to a thousandth. Beyond this, and once a file is not
#: small, what is inside is no scan.
RATIO = 100
_SMALL = 1 << 20
_STEP = 1 << 20
#: As other programs put them into archives; nobody means them as scans.
_CLUTTER = ("__MACOSX", ".DS_Store", "Thumbs.db")
#: What `zipfile` raises where an archive is damaged or of a kind that it does not know.
DAMAGED = (zipfile.BadZipFile, NotImplementedError, ValueError, IndexError)


@contextmanager
def gunzipped(path: Path) -> Iterator[Path]:
    """What is in ``scan.ply.gz``, as a file with the inner suffix.

    Raises
    ------
    InputError
        If it cannot be unpacked, or is far more than a scan can be.
    """
    with path.open("rb") as packed, TemporaryDirectory() as folder:
        file = Path(folder) / f"scan{path.with_suffix('').suffix.lower()}"
        with gzip.GzipFile(fileobj=packed) as stream:
            _unpack(stream, file, path.stat().st_size, f"{path}")
        yield file


@contextmanager
def unzipped(archive: zipfile.ZipFile, member: zipfile.ZipInfo, path: Path) -> Iterator[Path]:
    """What one member of an archive is, as a file with its suffix; as `gunzipped`."""
    where = f"{path}, {member.filename}"
    if member.flag_bits & 1:
        raise InputError(f"{where}: is encrypted; unpack the archive yourself")
    # The name in the archive is for people; the file has one of ours, in a folder of ours.
    with TemporaryDirectory() as folder:
        file = Path(folder) / f"scan{name_in(member).suffix.lower()}"
        with archive.open(member) as stream:
            _unpack(stream, file, member.compress_size, where)
        yield file


def members_of(
    archive: zipfile.ZipFile, suffixes: Container[str]
) -> tuple[list[zipfile.ZipInfo], list[str]]:
    """The members with one of the suffixes, and the names of the others."""
    members: list[zipfile.ZipInfo] = []
    others: list[str] = []
    for member in archive.infolist():
        name = name_in(member)
        if member.is_dir() or name.name in _CLUTTER or name.parts[0] in _CLUTTER:
            continue
        if name.suffix.lower() in suffixes:
            members.append(member)
        else:
            others.append(member.filename)
    return members, others


def remark_on(others: Sequence[str]) -> list[str]:
    """What is said of the other files of an archive: one sentence, or nothing."""
    if not others:
        return []
    return [f"{len(others)} file(s) of the archive that are no scans left out: {few(others)}"]


def shown_name(member: zipfile.ZipInfo, scan: str, scans: int) -> str:
    """The name of one of the scans of a member."""
    shown = "/".join(part for part in name_in(member).parts if part not in ("/", ".."))
    return f"{shown}/{scan}" if scan and scans > 1 else shown


def name_in(member: zipfile.ZipInfo) -> PurePosixPath:
    """The name of a member, whichever way its slashes lean."""
    return PurePosixPath(member.filename.replace("\\", "/"))


def _unpack(stream: IO[bytes] | gzip.GzipFile, file: Path, packed: int, where: str) -> None:
    """Write what is compressed to a file, unless it is far more than a scan can be."""
    most = max(RATIO * packed, _SMALL)
    size = 0
    try:
        with file.open("wb") as unpacked:
            while block := stream.read(_STEP):
                size += len(block)
                if size > most:
                    raise InputError(
                        f"{where}: expected at most {RATIO} times as much as the {packed} "
                        "compressed bytes, got more; unpack it yourself if it is a scan"
                    )
                unpacked.write(block)
    except (EOFError, zlib.error, zipfile.BadZipFile, gzip.BadGzipFile) as error:
        raise InputError(f"{where}: cannot be unpacked: {error}; is it truncated?") from error
