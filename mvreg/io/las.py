"""Read LAS and LAZ files through laspy.

The header is checked here first, because laspy 2.7 reads fewer points than a header announces
where the file is cut off, with no more than a line in a log.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.types.attributes import COLOURS, Values

#: Points at a time: what is made of a header that lies stays small.
_CHUNK = 500_000
#: In the order in which they are listed; extra dimensions of a file follow.
_KNOWN = ("intensity", *COLOURS, "nir", "return_number", "number_of_returns",
          "classification", "point_source_id", "scan_angle", "scan_angle_rank",
          "gps_time")  # fmt: skip


def read_las(path: Path) -> PointCloud:
    """Read the points, scaled and shifted in double precision, and what the file says of each.

    Points flagged as withheld, which the standard calls deleted, are left out, with a remark.
    Attributes that are zero throughout are not listed: many writers fill in columns that they do
    not know. Where the sensor was, the format does not say.

    Raises
    ------
    InputError
        With file, byte and reason: never fewer points than the header announces.
    """
    _check_header(path)
    import laspy

    try:
        with path.open("rb") as stream, laspy.open(stream, closefd=False, read_evlrs=False) as las:
            header = las.header
            count = int(header.point_count)
            scales = np.array(header.scales, dtype=np.float64)
            offsets = np.array(header.offsets, dtype=np.float64)
            parts = [_part(chunk, scales, offsets) for chunk in las.chunk_iterator(_CHUNK)]
    except (OSError, MemoryError):
        raise
    except BaseException as error:  # laspy, NumPy and a compiled library raise as they please
        if isinstance(error, (KeyboardInterrupt, SystemExit)):
            raise
        raise InputError(f"{path}: not a readable LAS or LAZ file: {error}") from error
    found = sum(len(points) for points, _, _ in parts)
    if found != count:
        raise InputError(
            f"{path}: the header announces {count} points, but {found} could be read; the file is "
            "truncated or damaged"
        )
    return _joined(parts, path)


def _part(chunk: Any, scales: Values, offsets: Values) -> tuple[Values, dict[str, Values], Values]:
    """Points (N, 3), attributes, and which points are withheld."""
    points = np.stack([np.asarray(chunk[axis]) for axis in "XYZ"], axis=1) * scales + offsets
    names = set(chunk.point_format.dimension_names)
    extra = list(chunk.point_format.extra_dimension_names)
    attributes: dict[str, Values] = {}
    for name in [*(each for each in _KNOWN if each in names), *extra]:
        values = np.array(chunk[name])
        if values.ndim == 2:
            attributes |= {f"{name}_{i}": values[:, i].copy() for i in range(values.shape[1])}
        else:
            attributes[name] = values
    withheld = np.asarray(chunk["withheld"], dtype=bool) if "withheld" in names else None
    return points, attributes, np.zeros(len(points), bool) if withheld is None else withheld


def _joined(parts: list[tuple[Values, dict[str, Values], Values]], path: Path) -> PointCloud:
    withheld = np.concatenate([each for _, _, each in parts])
    names = list(parts[0][1])
    attributes = {name: np.concatenate([each[name] for _, each, _ in parts]) for name in names}
    told = {name for name, values in attributes.items() if values.any()}
    if told & {*COLOURS}:
        told |= {*COLOURS}
    cloud = PointCloud(
        np.concatenate([points for points, _, _ in parts]),
        attributes={name: values for name, values in attributes.items() if name in told},
    )
    if not withheld.any():
        return cloud
    if withheld.all():
        raise InputError(f"{path}: all {len(withheld)} points are withheld; leave this file out")
    remark = f"{int(np.count_nonzero(withheld)):,} withheld points left out"
    kept = cloud.chosen(~withheld)
    return PointCloud(kept.points, attributes=kept.attributes, remarks=(remark,))


def _check_header(path: Path) -> None:
    """Compare what the header announces with how long the file is."""
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
    stream.seek(start)
    try:
        read = lazrs.read_chunk_table(stream, lazrs.LazVlr(before[at + 54 : at + 54 + record]))
    except Exception as error:  # a compiled library raises as it pleases
        raise InputError(f"{path}: not a readable LAZ file: {error}") from error
    in_chunks = sum(size for _, size in read)
    most = max((points for points, _ in read), default=0)
    if in_chunks > table - start - 8 or most > max(1_000_000, 1000 * size // max(length, 1)):
        raise InputError(
            f"{path}, byte {table}: the table tells of chunks of {in_chunks} bytes and up to "
            f"{most} points, found {table - start - 8} bytes before it; the file is damaged"
        )
    return sum(points for points, _ in read)
