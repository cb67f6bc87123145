"""The headers of LAS and LAZ files, held against the size of the file.

Because laspy 2.7 reads fewer points than a header announces where the file is cut off, with no more
than a line in a log, and lazrs 0.8 asks for whatever memory a damaged one tells of.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError

#: LAZ's compressor that keeps layers, the layers of its items by kind, and the kind of which each
#: byte is a layer.
LAYERED, LAYERS, BYTES = 3, {10: 9, 11: 1, 12: 2, 13: 1}, 14


def check_header(path: Path) -> int:
    """Compare what the header announces with how long the file is; the points announced.

    Raises
    ------
    InputError
        With file, byte and reason.
    """
    with path.open("rb") as stream:
        head = stream.read(375)
        size = stream.seek(0, 2)
        if head[:4] != b"LASF":
            raise InputError(
                f"{path}, byte 0: expected 'LASF', got {head[:4]!r}; is it another format?"
            )
        if len(head) < 227:
            raise InputError(f"{path}, byte {size}: the file ends within its header; truncated")
        (header_size,) = struct.unpack_from("<H", head, 94)
        start, vlrs = struct.unpack_from("<II", head, 96)
        kind, length, count = struct.unpack_from("<BHI", head, 104)
        if head[25] >= 4 and len(head) >= 255:
            (count,) = struct.unpack_from("<Q", head, 247)
        if header_size > start or start > size or vlrs * 54 > start - header_size:
            raise InputError(
                f"{path}, byte 94: a header of {header_size} bytes, {vlrs} records after it and "
                f"points from byte {start} on do not fit into {size} bytes; the file is truncated "
                "or damaged"
            )
        if not count:
            raise InputError(f"{path}: the header announces no points; leave this file out")
        if not kind & 0x80:
            room = (size - start) // max(length, 1)
        else:
            room = _room_in_chunks(stream, start, size, length, path)
        scales = struct.unpack_from("<6d", head, 131)
    if not np.isfinite(scales).all() or 0 in scales[:3]:
        raise InputError(f"{path}, byte 131: expected scales and offsets, got {scales}")
    if count > room:
        raise InputError(
            f"{path}: the header announces {count} points, but the {size} bytes of the file hold "
            f"{room} at most; the file is truncated or the number is wrong"
        )
    return int(count)


def _room_in_chunks(stream: Any, start: int, size: int, length: int, path: Path) -> int:
    """At most how many points a compressed file can hold.

    lazrs 0.8 asks for as much memory as the table of chunks and their size say, and ends the
    process where there is less. So both are held against the size of the file first: each chunk
    begins with a whole point, and no scan is compressed a thousandfold.
    """
    import lazrs

    stream.seek(0)
    before = stream.read(start)
    (table,) = struct.unpack("<q", stream.read(8).ljust(8, b"\xff"))
    if table == -1:  # written to a stream that could not go back
        stream.seek(size - 8)
        (table,) = struct.unpack("<q", stream.read(8))
    chunks = 0
    if start + 8 <= table <= size - 8:
        stream.seek(table + 4)
        (chunks,) = struct.unpack("<I", stream.read(4))
    if not 0 < chunks <= (table - start - 8) // max(length, 1):
        raise InputError(
            f"{path}, byte {start}: expected where the table of chunks begins, got {table}, and "
            f"{chunks} chunks there, in {size} bytes; the file is truncated or damaged"
        )
    at = before.find(b"laszip encoded") - 2
    if at < 0 or len(before) < at + 54 + 16:
        raise InputError(f"{path}: expected the record 'laszip encoded' before the points")
    (record,) = struct.unpack_from("<H", before, at + 20)
    vlr = before[at + 54 : at + 54 + record]
    stream.seek(start)
    try:
        read = lazrs.read_chunk_table(stream, lazrs.LazVlr(vlr))
    except Exception as error:  # a compiled library raises as it pleases
        raise InputError(f"{path}: not a readable LAZ file: {error}") from error
    in_chunks = sum(size for _, size in read)
    most = max((points for points, _ in read), default=0)
    if in_chunks > table - start - 8 or most > max(1_000_000, 1000 * size // max(length, 1)):
        raise InputError(
            f"{path}, byte {table}: the table tells of chunks of {in_chunks} bytes and up to "
            f"{most} points, found {table - start - 8} bytes before it; the file is damaged"
        )
    _check_layers(stream, vlr, start + 8, [size for _, size in read], length, path)
    return sum(points for points, _ in read)


def _check_layers(
    stream: Any, vlr: bytes, start: int, sizes: Sequence[int], length: int, path: Path
) -> None:
    """Hold the layers of each chunk against its size, for which lazrs asks for memory unseen.

    In point formats from 6 on, a chunk begins with a whole point and the number of points, and then
    the sizes of the layers that follow.
    """
    compressor, items = struct.unpack_from("<H30xH", vlr.ljust(34, b"\0"))
    if compressor != LAYERED:
        return
    layers = 0
    table = vlr[34 : 34 + 6 * items]
    for kind, size, _ in struct.iter_unpack("<3H", table[: len(table) // 6 * 6]):
        layers += size if kind == BYTES else LAYERS.get(kind, 0)
    head = length + 4 + 4 * layers
    for number, size in enumerate(sizes, start=1):
        stream.seek(start + length + 4)
        told = stream.read(4 * layers)
        inside = sum(struct.unpack(f"<{len(told) // 4}I", told[: len(told) // 4 * 4]))
        if head + inside > size:
            raise InputError(
                f"{path}, byte {start}: chunk {number} tells of layers of {inside} bytes, found "
                f"{max(0, size - head)}; the file is damaged"
            )
        start += size
