"""Compressed files: ``scan.ply.gz``, and ``.zip`` archives of scans."""

from __future__ import annotations

import gzip
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import IO

from mvreg.errors import InputError, few
from mvreg.io.cloud import PointCloud
from mvreg.io.formats import Format, ReadOptions, format_of

#: Text compresses to a fifth at best, zeros to a thousandth. Beyond this, and once a file is not
#: small, what is inside is no scan.
RATIO = 100
_SMALL = 1 << 20
_STEP = 1 << 20
#: As other programs put them into archives; nobody means them as scans.
_CLUTTER = ("__MACOSX", ".DS_Store", "Thumbs.db")


def with_compressed(formats: Mapping[str, Format]) -> dict[str, Format]:
    """Formats by suffix, and with them ``.gz`` and ``.zip`` of any of them."""

    def read_gz(path: Path, options: ReadOptions) -> Sequence[PointCloud]:
        return _gunzipped(path, options, formats)

    def read_zip(path: Path, options: ReadOptions) -> Sequence[PointCloud]:
        return _unzipped(path, options, formats)

    added = {".gz": Format("gzip", (".gz",), read_gz), ".zip": Format("ZIP", (".zip",), read_zip)}
    return {**formats, **{suffix: each for suffix, each in added.items() if suffix not in formats}}


def _gunzipped(
    path: Path, options: ReadOptions, formats: Mapping[str, Format]
) -> Sequence[PointCloud]:
    with path.open("rb") as packed, TemporaryDirectory() as folder:
        inner = format_of(path.with_suffix(""), formats)
        file = Path(folder) / f"scan{path.with_suffix('').suffix.lower()}"
        with gzip.GzipFile(fileobj=packed) as stream:
            _unpack(stream, file, path.stat().st_size, f"{path}")
        return _read(inner, file, options, f"{path}")


def _unzipped(
    path: Path, options: ReadOptions, formats: Mapping[str, Format]
) -> Sequence[PointCloud]:
    clouds: list[PointCloud] = []
    others: list[str] = []
    try:
        with path.open("rb") as packed, zipfile.ZipFile(packed) as archive:
            for member in archive.infolist():
                name = PurePosixPath(member.filename.replace("\\", "/"))
                if member.is_dir() or name.name in _CLUTTER or name.parts[0] in _CLUTTER:
                    continue
                if name.suffix.lower() not in formats:
                    others.append(member.filename)
                    continue
                clouds += _member(archive, member, name, options, formats, path)
    except (zipfile.BadZipFile, NotImplementedError, ValueError, IndexError) as error:
        raise InputError(f"{path}: not a readable ZIP archive: {error}") from error
    if not clouds:
        raise InputError(
            f"{path}: expected at least one file ending in {', '.join(formats)} in the archive; "
            f"found {', '.join(others[:10]) or 'none at all'}"
        )
    if others:
        remark = f"{len(others)} file(s) of the archive that are no scans left out: {few(others)}"
        clouds[0] = replace(clouds[0], remarks=(*clouds[0].remarks, remark))
    return clouds


def _member(
    archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: PurePosixPath, options: ReadOptions,
    formats: Mapping[str, Format], path: Path,
) -> list[PointCloud]:  # fmt: skip
    where = f"{path}, {member.filename}"
    if member.flag_bits & 1:
        raise InputError(f"{where}: is encrypted; unpack the archive yourself")
    # The name in the archive is for people; the file has one of ours, in a folder of ours.
    with TemporaryDirectory() as folder:
        file = Path(folder) / f"scan{name.suffix.lower()}"
        with archive.open(member) as stream:
            _unpack(stream, file, member.compress_size, where)
        found = _read(format_of(file, formats), file, options, where)
    shown = "/".join(part for part in name.parts if part not in ("/", ".."))
    return [
        replace(each, name=f"{shown}/{each.name}" if each.name and len(found) > 1 else shown)
        for each in found
    ]


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


def _read(inner: Format, file: Path, options: ReadOptions, where: str) -> Sequence[PointCloud]:
    try:
        return list(inner.read(file, options))
    except InputError as error:
        raise InputError(str(error).replace(str(file), where)) from error
