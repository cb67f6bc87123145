"""Read LAS and LAZ files through laspy, piece by piece."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.las_header import check_header
from mvreg.io.pieces import Pieces
from mvreg.types.attributes import COLOURS, Values

#: Points at a time: what is made of a header that lies stays small.
CHUNK = 100_000
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
    return las_pieces(path).whole()


def las_pieces(path: Path) -> Pieces:
    """The same piece by piece."""
    announced = check_header(path)
    told: set[str] = set()  # attributes that are not zero throughout

    def finish(cloud: PointCloud) -> PointCloud:
        kept = {name: values for name, values in cloud.attributes.items() if name in told}
        return replace(cloud, attributes=kept)

    def first() -> Iterator[PointCloud]:
        withheld = count = 0
        names: dict[str, np.dtype[Any]] = {}
        for cloud, kept in _parts(path):
            names = {name: values.dtype for name, values in cloud.attributes.items()}
            told.update(n for n, v in cloud.attributes.items() if n not in told and v.any())
            count += len(kept)
            withheld += len(kept) - int(np.count_nonzero(kept))
            yield _kept(cloud, kept)
        if told & {*COLOURS}:
            told.update(COLOURS)
        if withheld == count:
            raise InputError(f"{path}: all {count} points are withheld; leave this file out")
        found.kinds = {name: kind for name, kind in names.items() if name in told}
        if withheld:
            found.remarks = [f"{withheld:,} withheld points left out"]

    found = Pieces(
        lambda path: (finish(_kept(*part)) for part in _parts(path)), path, announced, finish=finish
    )
    found.clouds = first()
    return found


def _kept(cloud: PointCloud, kept: Values) -> PointCloud:
    return cloud if kept.all() else cloud.chosen(kept)


def _parts(path: Path) -> Iterator[tuple[PointCloud, Values]]:
    """All points in pieces, with all attributes, and which of them (N,) are not withheld."""
    import laspy

    with path.open("rb") as stream, ExitStack() as stack:
        opened = _said(path, laspy.open, stream, closefd=False, read_evlrs=False)
        las = stack.enter_context(opened)
        scales = np.array(las.header.scales, dtype=np.float64)
        offsets = np.array(las.header.offsets, dtype=np.float64)
        count, found = int(las.header.point_count), 0
        chunks = las.chunk_iterator(CHUNK)
        while (part := _said(path, _next, chunks, scales, offsets)) is not None:
            found += len(part[1])
            yield part
    if found != count:
        raise InputError(
            f"{path}: the header announces {count} points, but {found} could be read; the file is "
            "truncated or damaged"
        )


def _said(path: Path, function: Callable[..., Any], *given: Any, **more: Any) -> Any:
    """What a call returns, whatever it raises told as of the file."""
    try:
        return function(*given, **more)
    except (OSError, MemoryError):
        raise
    except BaseException as error:  # laspy, NumPy and a compiled library raise as they please
        if isinstance(error, (KeyboardInterrupt, SystemExit)):
            raise
        raise InputError(f"{path}: not a readable LAS or LAZ file: {error}") from error


def _next(chunks: Any, scales: Values, offsets: Values) -> tuple[PointCloud, Values] | None:
    """The next points, and which are not withheld; None at the end."""
    chunk = next(chunks, None)
    if chunk is None:
        return None
    points = np.empty((len(chunk), 3))
    for column, axis, scale, offset in zip(points.T, "XYZ", scales, offsets, strict=True):
        np.multiply(chunk[axis], scale, out=column)
        column += offset
    names = set(chunk.point_format.dimension_names)
    extra = list(chunk.point_format.extra_dimension_names)
    attributes: dict[str, Values] = {}
    for name in [*(each for each in _KNOWN if each in names), *extra]:
        values = np.array(chunk[name])
        if values.ndim == 2:
            attributes |= {f"{name}_{i}": values[:, i].copy() for i in range(values.shape[1])}
        else:
            attributes[name] = values
    kept = ~np.asarray(chunk["withheld"], dtype=bool) if "withheld" in names else None
    return (
        PointCloud(points, attributes=attributes),
        np.ones(len(points), bool) if kept is None else kept,
    )
