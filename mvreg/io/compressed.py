"""Compressed files: ``scan.ply.gz``, and ``.zip`` archives of scans."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.compressed_pieces import pieces_of_gz, pieces_of_zip
from mvreg.io.formats import Format, ReadOptions, format_of
from mvreg.io.unpacked import DAMAGED, gunzipped, members_of, remark_on, shown_name, unzipped


def with_compressed(formats: Mapping[str, Format]) -> dict[str, Format]:
    """Formats by suffix, and with them ``.gz`` and ``.zip`` of any of them."""
    added = {
        ".gz": Format(
            "gzip", (".gz",), partial(_gunzipped, formats=formats),
            partial(pieces_of_gz, formats=formats),
        ),
        ".zip": Format(
            "ZIP", (".zip",), partial(_unzipped, formats=formats),
            partial(pieces_of_zip, formats=formats),
        ),
    }  # fmt: skip
    return {**formats, **{suffix: each for suffix, each in added.items() if suffix not in formats}}


def _gunzipped(
    path: Path, options: ReadOptions, formats: Mapping[str, Format]
) -> Sequence[PointCloud]:
    with path.open("rb"):  # if it is not there, that comes first
        inner = format_of(path.with_suffix(""), formats)
    with gunzipped(path) as file:
        return _read(inner, file, options, f"{path}")


def _unzipped(
    path: Path, options: ReadOptions, formats: Mapping[str, Format]
) -> Sequence[PointCloud]:
    clouds: list[PointCloud] = []
    try:
        with path.open("rb") as packed, zipfile.ZipFile(packed) as archive:
            members, others = members_of(archive, formats)
            for member in members:
                with unzipped(archive, member, path) as file:
                    inner = format_of(file, formats)
                    found = _read(inner, file, options, f"{path}, {member.filename}")
                clouds += [
                    replace(each, name=shown_name(member, each.name, len(found))) for each in found
                ]
    except DAMAGED as error:
        raise InputError(f"{path}: not a readable ZIP archive: {error}") from error
    if not clouds:
        raise InputError(
            f"{path}: expected at least one file ending in {', '.join(formats)} in the archive; "
            f"found {', '.join(others[:10]) or 'none at all'}"
        )
    clouds[0] = replace(clouds[0], remarks=(*clouds[0].remarks, *remark_on(others)))
    return clouds


def _read(inner: Format, file: Path, options: ReadOptions, where: str) -> Sequence[PointCloud]:
    try:
        return list(inner.read(file, options))
    except InputError as error:
        raise InputError(str(error).replace(str(file), where)) from error
