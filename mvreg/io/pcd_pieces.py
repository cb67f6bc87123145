"""The points of a large PCD file, piece by piece; only of files that are as they should be."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.names import cloud_of
from mvreg.io.pcd import columns_of, remarks_on
from mvreg.io.pcd_header import PcdHeader, read_header
from mvreg.io.pieces import NotInPiecesError, Pieces, byte_rows, head_of, text_rows
from mvreg.types.attributes import Values


def pcd_pieces(path: Path) -> Pieces:
    """The points of a file in text or bytes.

    Raises
    ------
    NotInPiecesError
        If it is compressed, field after field, or damaged.
    """
    try:
        header = read_header(head_of(path), path)
    except InputError as error:
        raise NotInPiecesError from error
    if header.data not in ("ascii", "binary"):
        raise NotInPiecesError
    return Pieces(
        lambda path: map(cloud_of, _values(path, header)), path, header.points,
        header.view_point, remarks=[*remarks_on(header)],
    )  # fmt: skip


def _values(path: Path, header: PcdHeader) -> Iterator[dict[str, Values]]:
    if header.data == "ascii":
        columns = sum(field.count for field in header.fields)
        for table in text_rows(path, header.size, header.points, columns):
            yield columns_of(table, header)
        return
    for records in byte_rows(path, header.size, header.points, header.dtype):
        yield {field.name: records[field.name].astype(field.numpy) for field in header.scalars}
