"""Read points from tables of text: XYZ, TXT, CSV, ASC, in the ways that people write them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mvreg.errors import InputError, NoScanError
from mvreg.io.cloud import PointCloud
from mvreg.io.columns import attributes_of, counters, poses_in, telling_rows
from mvreg.io.pieces import NotInPiecesError, Pieces
from mvreg.io.text_layout import Layout
from mvreg.io.text_stream import TextTable, open_table
from mvreg.types import Array
from mvreg.types.attributes import Values
from mvreg.types.column_names import axes_named, split_heading

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
    source = open_table(path)
    chosen = _chosen(columns, source.layout, path)
    table = np.concatenate([*source.rows(chosen.axes)])
    if not columns and (what := poses_in(table, chosen.names)):
        raise NoScanError(f"{path}: expected points, found {what}; leave this file out")
    points = np.ascontiguousarray(table[:, chosen.axes])
    lost = int(np.isnan(points).any(axis=1).sum())
    return PointCloud(
        points,
        attributes=_attributes(table, chosen),
        remarks=(*_missing(lost, len(points)), *([] if chosen.named else _doubts(table, chosen))),
    )


def text_pieces(path: Path, columns: Sequence[str] = ()) -> Pieces:
    """The same table piece by piece.

    Raises
    ------
    NotInPiecesError
        If it has no three numbers in a row, or the columns are not those told. Read whole, it says
        so.
    """
    try:
        source = open_table(path)
        chosen = _chosen(columns, source.layout, path)
    except InputError as error:
        raise NotInPiecesError from error
    telling: list[Array] = []
    count = int(path.stat().st_size / max(1.0, source.row_length))
    found = Pieces(
        lambda path: _clouds(open_table(path), chosen, np.concatenate(telling)), path, count
    )
    found.clouds = _points(source, chosen, bool(columns), found, telling)
    return found


def _points(
    source: TextTable, chosen: _Columns, told: bool, found: Pieces, telling: list[Array]
) -> Iterator[PointCloud]:
    """The points of each piece; what all rows say besides is kept: some of them tell."""
    poses, lost, rows = not told, 0, 0
    for table in source.rows(chosen.axes):
        if not telling and not chosen.named:
            found.remarks += _doubts(table, chosen)
        telling.append(telling_rows(table))
        poses = poses and bool(poses_in(table, chosen.names))
        points = np.ascontiguousarray(table[:, chosen.axes])
        lost, rows = lost + int(np.isnan(points).any(axis=1).sum()), rows + len(points)
        yield PointCloud(points)
    if poses:
        raise NotInPiecesError
    found.remarks = [*_missing(lost, rows), *found.remarks]
    found.add_kinds(_attributes(np.concatenate(telling), chosen))


def _clouds(source: TextTable, chosen: _Columns, telling: Array) -> Iterator[PointCloud]:
    """All pieces with their attributes, which beside the rows that tell are those of the whole."""
    for table in source.rows(chosen.axes):
        values = _attributes(np.concatenate([table, telling]), chosen)
        yield PointCloud(
            np.ascontiguousarray(table[:, chosen.axes]),
            attributes={name: column[: len(table)] for name, column in values.items()},
        )


def _attributes(table: Array, chosen: _Columns) -> dict[str, Values]:
    return attributes_of(table, chosen.axes, chosen.names, chosen.skip)


def _chosen(columns: Sequence[str], layout: Layout, path: Path) -> _Columns:
    return _told(columns, layout, path) if columns else _found(layout, path)


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


def _missing(lost: int, rows: int) -> list[str]:
    return [f"left out {lost:,} of {rows:,} rows without coordinates"] if lost else []


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
