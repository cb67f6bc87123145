"""The vertices of an ASCII PLY file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.ply_header import Element, Header
from mvreg.io.table import excerpt, parse, parse_lines
from mvreg.types import Array


def read_ascii(data: bytes, header: Header, path: Path) -> Array:
    """Read the vertices (N, 3): one line each, as the format has it.

    Raises
    ------
    InputError
        With file, line and reason.
    """
    vertex = header.elements[header.vertex_index]
    text = data[header.size :].decode("latin-1")
    if header.newline == b"\r":
        text = text.replace("\r", "\n")
    text, first = _skip(text, header, path)
    lines = text.split("\n", vertex.count)
    _check_end(lines, header, first, path)
    names = [p.name for p in vertex.properties if p.count is None]
    table = None if vertex.has_lists else parse(lines[: vertex.count], len(names))
    if table is None:
        numbered = enumerate(text.split("\n"), first)
        rows = _without_lists(numbered, vertex, path) if vertex.has_lists else numbered
        table = parse_lines(rows, len(names), path, vertex.count)
    if len(table) < vertex.count:
        raise _truncated(path, first + text.count("\n"), len(table), vertex.count)
    return table[:, [names.index(axis) for axis in "xyz"]]


def _skip(text: str, header: Header, path: Path) -> tuple[str, int]:
    """The text from the first vertex on, and the number of its line."""
    line = header.lines + 1
    left = sum(e.count for e in header.elements[: header.vertex_index])
    position = 0
    while left:
        end = text.find("\n", position)
        if end < 0:
            raise InputError(f"{path}, line {line}: the file ends before the vertices begin")
        if text[position:end].strip():
            left -= 1
        position, line = end + 1, line + 1
    return text[position:], line


def _check_end(lines: list[str], header: Header, first: int, path: Path) -> None:
    """Notice a file cut off within its last vertex, and points that the header does not count."""
    count = header.elements[header.vertex_index].count
    more = sum(e.count for e in header.elements[header.vertex_index + 1 :])
    if more and len(lines) <= count:
        raise _truncated(path, first + len(lines) - 1, len(lines) - 1, count)
    rest = lines[count].strip(" \t\r\n\0\x1a") if len(lines) > count else ""
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
