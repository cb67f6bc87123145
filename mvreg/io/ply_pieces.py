"""The vertices of a large PLY file, piece by piece; only of files that are as they should be."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.names import cloud_of
from mvreg.io.pieces import NotInPiecesError, Pieces, byte_rows, head_of, text_rows
from mvreg.io.ply_ascii import columns_of
from mvreg.io.ply_binary import native, record_of
from mvreg.io.ply_header import Header, read_header
from mvreg.types.attributes import Values


def ply_pieces(path: Path) -> Pieces:
    """The vertices of a file without lists, with no other elements.

    Raises
    ------
    NotInPiecesError
        If it has any, or is damaged.
    """
    try:
        header = read_header(head_of(path), path)
    except InputError as error:
        raise NotInPiecesError from error
    vertex = header.elements[header.vertex_index]
    others = [each for each in header.elements if each is not vertex and each.count]
    if others or vertex.has_lists or header.newline == b"\r":
        raise NotInPiecesError
    return Pieces(lambda path: map(cloud_of, _values(path, header)), path, vertex.count)


def _values(path: Path, header: Header) -> Iterator[dict[str, Values]]:
    vertex = header.elements[header.vertex_index]
    if header.format == "ascii":
        for table in text_rows(path, header.size, vertex.count, len(vertex.properties)):
            yield columns_of(table, vertex, path)
        return
    record = record_of(vertex, "<" if header.format == "binary_little_endian" else ">", path)
    for records in byte_rows(path, header.size, vertex.count, record):
        yield native(records)
