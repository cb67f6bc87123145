"""Read points from tables of text: XYZ, TXT, CSV, ASC, in the ways that people write them."""

from __future__ import annotations

import codecs
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mvreg.errors import InputError, NoScanError
from mvreg.io.cloud import PointCloud
from mvreg.io.column_names import axes_named, split_heading
from mvreg.io.columns import attributes_of, counters, poses_in
from mvreg.io.text_layout import Layout, find_layout
from mvreg.io.text_rows import parse_table
from mvreg.types import Array

#: The longer mark first: that of UTF-32 begins with that of UTF-16.
_MARKS = {
    codecs.BOM_UTF32_LE: "utf-32", codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16",
}  # fmt: skip
#: In `columns`, a column that is not wanted.
SKIP = "_"


@dataclass(frozen=True)
class _Columns:
    """Which columns are x, y and z, what all are called, and which are not wanted."""

    axes: tuple[int, int, int]
    names: list[str] | None
    skip: frozenset[int]
    named: bool = True


def read_text(path: Path, columns: Sequence[str] = ()) -> PointCloud:
    """Read a table with x, y and z in it.

    Columns may be parted by blanks, tabs, commas, semicolons or bars, and quoted; decimal commas
    and thousands that are parted are understood where they cannot be mistaken. Lines before the
    first row are a header. The columns are those that `columns` or the header calls x, y and z, or
    easting, northing and height; or else the first three that hold numbers. The others become
    attributes.

    Parameters
    ----------
    path : Path
    columns : sequence of str
        The columns' names, in order; ``_`` for those not wanted. They replace the header's.

    Raises
    ------
    NoScanError
        If there is no row of three numbers, or all are poses.
    InputError
        With file, line and reason.
    """
    data = _as_utf8(path.read_bytes(), path)
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    layout = find_layout(data, path)
    chosen = _told(columns, layout, path) if columns else _found(layout, path)
    table = parse_table(data, layout, chosen.axes, path)
    del data
    if not columns and (what := poses_in(table, chosen.names)):
        raise NoScanError(f"{path}: expected points, found {what}; leave this file out")
    points = np.ascontiguousarray(table[:, chosen.axes])
    return PointCloud(
        points,
        attributes=attributes_of(table, chosen.axes, chosen.names, chosen.skip),
        remarks=(*_missing(points), *([] if chosen.named else _doubts(table, chosen))),
    )


def _as_utf8(data: bytes, path: Path) -> bytes:
    for mark, encoding in _MARKS.items():
        if data.startswith(mark):
            try:
                return data.decode(encoding).encode()
            except UnicodeError as error:
                raise InputError(f"{path}: expected text in {encoding}: {error}") from error
    return data.removeprefix(codecs.BOM_UTF8)


def check_columns(columns: Sequence[str]) -> None:
    """Refuse names of columns that do not say which are x, y and z.

    Raises
    ------
    InputError
        With the names.
    """
    lower = [name.lower() for name in columns]
    unclear = columns and axes_named(columns) is None
    if unclear or any(lower.count(axis) > 1 for axis in "xyz"):
        raise InputError(
            f"dataset.columns=[{','.join(columns)}]: expected the names of the columns in order, "
            f"with x, y and z among them once each, such as [time,x,y,z]; {SKIP} passes one over"
        )


def _told(columns: Sequence[str], layout: Layout, path: Path) -> _Columns:
    check_columns(columns)
    axes = axes_named(columns)
    assert axes is not None
    if max(axes) >= layout.columns:
        raise InputError(
            f"{path}, line {layout.number}: expected {len(columns)} columns, as dataset.columns "
            f"says, got {layout.columns}"
        )
    names = [*columns, *[""] * layout.columns][: layout.columns]
    skip = frozenset(i for i, name in enumerate(names) if name == SKIP or i >= len(columns))
    return _Columns(axes, names, skip | layout.words)


def _found(layout: Layout, path: Path) -> _Columns:
    """By the heading that names x, y and z; else the first three columns of numbers."""
    parts = dict.fromkeys([layout.part, ",", ";", "\t", "|", ""])
    named: list[str] | None = None
    for line in layout.heading:
        for names in split_heading(line, parts):
            if len(names) == layout.columns + 1 and layout.part:  # it ends in what parts the names
                names = names[:-1]
            axes = axes_named(names)
            if axes and len(names) <= layout.columns and not layout.words & set(axes):
                return _Columns(axes, [*names, *[""] * (layout.columns - len(names))], layout.words)
            if named is None and len(names) == layout.columns > 3 and line is layout.heading[0]:
                named = names
    x, y, z = [place for place in range(layout.columns) if place not in layout.words][:3]
    return _Columns((x, y, z), named, layout.words, named=False)


def _missing(points: Array) -> list[str]:
    lost = int(np.isnan(points).any(axis=1).sum())
    return [f"left out {lost:,} of {len(points):,} rows without coordinates"] if lost else []


def _doubts(table: Array, chosen: _Columns) -> list[str]:
    """What is said where x, y and z were taken without a name, and may be other columns."""
    why = counters(table, chosen.axes)
    if why is None and chosen.names:
        why = f"its header says {', '.join(chosen.names)}"
    if why is None:
        return []
    x, y, z = (axis + 1 for axis in chosen.axes)
    return [
        f"took columns {x}, {y} and {z} of {table.shape[1]} for x, y and z, but {why}; if others "
        "are meant, name all columns in order, such as dataset.columns=[_,_,x,y,z]"
    ]
