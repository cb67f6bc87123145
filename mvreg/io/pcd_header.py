"""The header of a PCD file, version 0.7 and before."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.io.table import excerpt
from mvreg.types import Array

_TYPES = {"F4", "F8", "I1", "I2", "I4", "I8", "U1", "U2", "U4", "U8"}
_DATA = ("ascii", "binary", "binary_compressed")


@dataclass(frozen=True)
class Field:
    """One field of a point: `count` values of NumPy's type `code`."""

    name: str
    code: str
    count: int

    @property
    def size(self) -> int:
        """Bytes."""
        return int(self.code[1]) * self.count

    @property
    def numpy(self) -> str:
        """The type of a value: PCD is little endian."""
        return "<" + self.code.lower()


@dataclass(frozen=True)
class PcdHeader:
    """What the header says, and where the data begin: byte `size`, after `lines` lines.

    `view_point` (3,) is the sensor's position in the coordinates of the points, None where the
    header does not tell it.
    """

    fields: tuple[Field, ...]
    points: int
    data: str
    size: int
    lines: int
    view_point: Array | None = None

    @property
    def record(self) -> int:
        """Bytes per point."""
        return sum(field.size for field in self.fields)

    @property
    def scalars(self) -> tuple[Field, ...]:
        """The fields of one value; of several with one name the first; padding is left out."""
        first = {f.name: f for f in reversed(self.fields) if f.count == 1 and f.name != "_"}
        return tuple(f for f in self.fields if first.get(f.name) is f)

    @property
    def offsets(self) -> dict[str, int]:
        """Where in a record each of `scalars` begins, in bytes."""
        starts = np.cumsum([0, *(f.size for f in self.fields)]).tolist()
        return {f.name: starts[self.fields.index(f)] for f in self.scalars}

    @property
    def dtype(self) -> np.dtype[Any]:
        """The `scalars` within a record."""
        return np.dtype(
            {
                "names": list(self.offsets),
                "formats": [f.numpy for f in self.scalars],
                "offsets": list(self.offsets.values()),
                "itemsize": self.record,
            }
        )


def read_header(data: bytes, path: Path) -> PcdHeader:
    """Parse the header.

    Raises
    ------
    InputError
        With file, line and reason.
    """
    entries: dict[str, list[str]] = {}
    position, lines = 0, 0
    while "DATA" not in entries:
        end = data.find(b"\n", position)
        if end < 0:
            raise InputError(f"{path}, line {lines + 1}: expected a PCD header up to 'DATA'")
        line = data[position:end].decode("latin-1")
        position, lines = end + 1, lines + 1
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if not words[0].isalpha() or not words[0].isascii():
            raise InputError(f"{path}, line {lines}: expected a PCD header, got {excerpt(line)}")
        entries[words[0].upper()] = words[1:]
    kind = " ".join(entries["DATA"]).lower()
    if kind not in _DATA:
        raise InputError(f"{path}, line {lines}: expected DATA {', '.join(_DATA)}; got {kind!r}")
    fields, points = _fields(entries, path), _points(entries, path)
    return PcdHeader(fields, points, kind, position, lines, _view_point(entries, path))


def _fields(entries: dict[str, list[str]], path: Path) -> tuple[Field, ...]:
    names = [name.lower() for name in entries.get("FIELDS", entries.get("COLUMNS", []))]
    sizes, types = entries.get("SIZE", []), entries.get("TYPE", [])
    counts = entries.get("COUNT", ["1"] * len(names))
    if not len(names) == len(sizes) == len(types) == len(counts):
        raise InputError(
            f"{path}: expected as many SIZE, TYPE and COUNT as FIELDS, got {len(sizes)}, "
            f"{len(types)}, {len(counts)} and {len(names)}"
        )
    codes = [kind.upper() + size for kind, size in zip(types, sizes, strict=True)]
    bad = sorted(set(codes) - _TYPES)
    if bad or not all(count.isdecimal() and len(count) < 7 for count in counts):
        raise InputError(f"{path}: expected TYPE F, I or U of SIZE 1 to 8, got {bad or counts}")
    fields = tuple(map(Field, names, codes, map(int, counts)))
    if not {"x", "y", "z"} <= {field.name for field in fields if field.count == 1}:
        raise InputError(f"{path}: expected fields x, y and z, got {names}")
    return fields


def _points(entries: dict[str, list[str]], path: Path) -> int:
    counts = entries.get("POINTS")
    if counts is None:
        counts = [*entries.get("WIDTH", ["?"]), *entries.get("HEIGHT", ["1"])]
    if not counts or not all(c.isdecimal() and c.isascii() and len(c) < 16 for c in counts):
        raise InputError(f"{path}: expected a number of POINTS, got {' '.join(counts)!r}")
    return int(np.prod([int(c) for c in counts], dtype=object))


def _view_point(entries: dict[str, list[str]], path: Path) -> Array | None:
    """The translation of VIEWPOINT; None for the default pose, which most writers always write.

    A quaternion of zeros is no rotation, and says as little.
    """
    words = entries.get("VIEWPOINT")
    if words is None:
        return None
    try:
        pose = np.array([float(word) for word in words])
    except ValueError:
        pose = np.empty(0)
    if pose.shape != (7,) or not np.isfinite(pose).all():
        raise InputError(
            f"{path}: expected VIEWPOINT with 7 numbers, tx ty tz qw qx qy qz; "
            f"got {excerpt(' '.join(words))}"
        )
    turned = pose[4:].any()
    return pose[:3] if pose[:3].any() or turned else None
