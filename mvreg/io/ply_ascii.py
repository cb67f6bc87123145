"""The vertices of an ASCII PLY file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io.ply_header import Element, Header, code_of
from mvreg.io.table import as_declared, excerpt, parse_lines
from mvreg.kernels.text import parse_rows
from mvreg.types import Array
from mvreg.types.attributes import Values

#: What may be left at the end of a file.
_NOTHING = " \t\r\n\0\x1a"


def read_ascii(data: bytes, header: Header, path: Path) -> dict[str, Values]:
    """Read the scalar properties of the vertices, each (N,): one line a vertex.

    Raises
    ------
    InputError
        With file, line and reason.
    """
    vertex = header.elements[header.vertex_index]
    if header.newline == b"\r":
        data = data.replace(b"\r", b"\n")
    start, first = _skip(data, header, path)
    table = _clean(data, start, header)
    if table is None:
        table = _line_by_line(data[start:].decode("latin-1"), first, header, path)
    return columns_of(table, vertex, path)


def columns_of(table: Array, vertex: Element, path: Path) -> dict[str, Values]:
    """The scalar properties of vertices, each (N,), from the numbers of their lines."""
    names = [p.name for p in vertex.properties if p.count is None]
    kinds = {p.name: np.dtype(code_of(p.type, path)) for p in vertex.scalars}
    columns = {name: table[:, names.index(name)] for name in kinds}
    return {
        name: column if name in ("x", "y", "z") else as_declared(column, kinds[name])
        for name, column in columns.items()
    }


def _skip(data: bytes, header: Header, path: Path) -> tuple[int, int]:
    """Where the first vertex begins, and the number of its line."""
    line = header.lines + 1
    left = sum(e.count for e in header.elements[: header.vertex_index])
    position = header.size
    while left:
        end = data.find(b"\n", position)
        if end < 0:
            raise InputError(f"{path}, line {line}: the file ends before the vertices begin")
        if data[position:end].decode("latin-1").strip():
            left -= 1
        position, line = end + 1, line + 1
    return position, line


def _after(header: Header) -> int:
    """How many records of other elements follow the vertices."""
    return sum(e.count for e in header.elements[header.vertex_index + 1 :])


def _clean(data: bytes, start: int, header: Header) -> Array | None:
    """The vertices of a file without lists among them and without flaws; else None."""
    vertex = header.elements[header.vertex_index]
    if vertex.has_lists:
        return None
    parsed = parse_rows(data, start, vertex.count, len(vertex.properties))
    if parsed is None:
        return None
    table, end = parsed
    if _after(header):
        return table if data[end - 1 : end] == b"\n" else None
    return None if data[end:].strip(_NOTHING.encode()) else table


def _line_by_line(text: str, first: int, header: Header, path: Path) -> Array:
    """The vertices of any file, whose first is in line `first`, or what is wrong with them."""
    vertex = header.elements[header.vertex_index]
    lines = text.split("\n")
    _check_end(lines, header, first, path)
    names = [p.name for p in vertex.properties if p.count is None]
    numbered = enumerate(lines, first)
    rows = _without_lists(numbered, vertex, path) if vertex.has_lists else numbered
    table = parse_lines(rows, len(names), path, vertex.count)
    if len(table) < vertex.count:
        raise _truncated(path, first + text.count("\n"), len(table), vertex.count)
    return table


def _check_end(lines: list[str], header: Header, first: int, path: Path) -> None:
    """Notice a file cut off within its last vertex, and points that the header does not count."""
    count = header.elements[header.vertex_index].count
    more = _after(header)
    if more and len(lines) <= count:
        raise _truncated(path, first + len(lines) - 1, len(lines) - 1, count)
    rest = "\n".join(lines[count:]).strip(_NOTHING)
    if rest and not more and all(line.strip() for line in lines[:count]):
        raise InputError(
            f"{path}, line {first + count}: expected the end of the file after {count} vertices, "
            f"got {excerpt(rest)}; the header's count is wrong"
        )


def _truncated(path: Path, line: int, found: int, count: int) -> InputError:
    return InputError(
        f"{path}, line {line}: the file ends after {found} of {count} vertices; it is truncated"
    )


def _without_lists(
    lines: Iterator[tuple[int, str]], vertex: Element, path: Path
) -> Iterator[tuple[int, str]]:
    """The lines with the list properties taken out."""
    for number, line in lines:
        words = iter(line.split())
        kept: list[str] = []
        try:
            for prop in vertex.properties:
                if prop.count is None:
                    kept.append(next(words))
                else:
                    for _ in range(int(next(words))):
                        next(words)
        except (StopIteration, ValueError, OverflowError):
            if line.strip():
                raise InputError(
                    f"{path}, line {number}: expected the properties "
                    f"{', '.join(p.name for p in vertex.properties)}, got {excerpt(line)}"
                ) from None
        yield number, " ".join([*kept, *words])
