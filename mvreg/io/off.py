"""Read OFF files: vertices, colours and triangles of a mesh."""

from __future__ import annotations

import re
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.faces import fan
from mvreg.io.stations import Lines
from mvreg.types.attributes import Values
from mvreg.types.colours import as_bytes, colours

_HEADER = re.compile(r"(ST)?(C)?(N)?(4)?(n)?OFF\s*(BINARY)?\s*(.*)")


def read_off(path: Path) -> PointCloud:
    """Read the vertices (N, 3), the colours of ``COFF``, and the faces cut into triangles.

    Raises
    ------
    InputError
        With file, line and reason; of kinds of OFF, binary and four-dimensional ones are refused.
    """
    lines = Lines.of(path)
    kind = _skip(lines) and _HEADER.fullmatch(lines.peek().split("#")[0].strip())
    if not kind:
        raise lines.error("'OFF'")
    if kind[4] or kind[5] or kind[6]:
        raise lines.error("an OFF file in text with 3 coordinates; convert it to PLY")
    counts = kind[7]
    lines.next()
    if not counts:
        if not _skip(lines):
            raise lines.error("the numbers of vertices, faces and edges")
        counts = lines.next().split("#")[0]
    words = counts.split()
    if len(words) not in (2, 3) or not all(re.fullmatch(r"\d{1,18}", word) for word in words):
        raise InputError(
            f"{path}, line {lines.number - 1}: expected the numbers of vertices, faces and edges, "
            f"got {counts[:40]!r}"
        )
    vertices, faces = int(words[0]), int(words[1])
    if not vertices:
        raise InputError(f"{path}: the header announces no vertices; leave this file out")
    if not _skip(lines):
        raise lines.error(f"{vertices} vertices")
    columns = len(lines.peek().split("#")[0].split())
    if columns < 3:
        raise lines.error("'X Y Z'")
    table = lines.table(vertices, columns)
    attributes: dict[str, Values] = {}
    if kind[3] and columns >= 6:
        attributes |= {name: table[:, 3 + i].copy() for i, name in enumerate(("nx", "ny", "nz"))}
    if kind[2] and columns >= (start := 6 if kind[3] else 3) + 3:
        attributes |= colours(as_bytes(table[:, start : start + 3]))
    return PointCloud(table[:, :3], attributes=attributes, triangles=_faces(lines, faces, vertices))


def _skip(lines: Lines) -> bool:
    """Go on to the next line that is neither blank nor a comment; whether there is one."""
    while lines.skip_blank():
        if not lines.peek().lstrip().startswith("#"):
            return True
        lines.next()
    return False


def _faces(lines: Lines, count: int, vertices: int) -> Values | None:
    polygons: list[list[int]] = []
    for _ in range(count):
        if not _skip(lines):
            raise InputError(
                f"{lines.path}, line {lines.number}: the file ends after {len(polygons)} of "
                f"{count} faces; it is truncated"
            )
        words = lines.peek().split("#")[0].split()
        try:
            size = int(words[0])
            corners = [int(word) for word in words[1 : 1 + size]]
        except ValueError:
            raise lines.error("the number of corners of a face and their indices") from None
        if size < 0 or len(corners) != size or any(not 0 <= i < vertices for i in corners):
            raise lines.error(f"a face of corners 0 to {vertices - 1}")
        polygons.append(corners)
        lines.next()
    return fan(polygons)
