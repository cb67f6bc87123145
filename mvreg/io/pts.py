"""Read PTS files: the points of one or several stations, each after their count."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mvreg.io.cloud import PointCloud
from mvreg.io.stations import Lines, with_points
from mvreg.io.text import read_text
from mvreg.types import Array
from mvreg.types.attributes import Values
from mvreg.types.colours import colours

COUNT = re.compile(r"\s*(\d{1,18})\s*")


def read_pts(path: Path, columns: Sequence[str] = ()) -> Sequence[PointCloud]:
    """Read the stations of a file that begins with a count; any other as a table, `read_text`.

    A row is ``x y z``, ``x y z intensity``, ``x y z red green blue`` or
    ``x y z intensity red green blue``. All points are in one frame; the format does not say which,
    nor where the scanners stood. `columns` are those of a table, as `read_text` takes them.

    Raises
    ------
    InputError
        With file, line and reason; also where a count is not that of the rows that follow it.
    """
    lines = Lines.of(path)
    if not lines.skip_blank() or COUNT.fullmatch(lines.peek()) is None:
        return (read_text(path, columns),)
    clouds: list[PointCloud] = []
    while lines.skip_blank():
        count = COUNT.fullmatch(lines.peek())
        if count is None:
            raise lines.error("the end of the file or the count of another station")
        lines.next()
        clouds.append(_station(lines, int(count[1]), f"station{len(clouds) + 1}"))
    if len(clouds) == 1:
        clouds = [replace(clouds[0], name="")]
    return with_points(clouds, path)


def _station(lines: Lines, count: int, name: str) -> PointCloud:
    if not count:
        return PointCloud(np.empty((0, 3)), name=name)
    if not lines.skip_blank():
        raise lines.error(f"{count} points")
    columns = len(lines.peek().split())
    if columns < 3:
        raise lines.error("at least 3 numbers")
    table = lines.table(count, columns)
    return PointCloud(table[:, :3], attributes=attributes(table), name=name)


def attributes(table: Array) -> dict[str, Values]:
    """Intensity and colours of rows ``x y z`` with 0, 1, 3 or 4 more columns; else nothing."""
    more = table.shape[1] - 3
    found: dict[str, Values] = {"intensity": table[:, 3].copy()} if more in (1, 4) else {}
    return {**found, **colours(table[:, -3:])} if more in (3, 4) else found
