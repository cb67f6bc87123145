"""What columns and arrays are called, and which of them are x, y and z: of files and of tables."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from mvreg.types.attributes import COLOURS, NORMALS, Values

#: What arrays of several numbers a point are called, in small letters.
POINTS = (
    "points", "positions", "position", "xyz", "vertices", "coordinates", "coords", "pos", "pts",
)  # fmt: skip
WHOLE_COLOURS = ("colors", "colours", "color", "colour", "rgb")
WHOLE_NORMALS = ("normals", "normal")
#: Triples of names, and those that they stand for: of MeshLab's and PCL's files, and of tables.
TRIPLES: dict[tuple[str, str, str], tuple[str, str, str]] = {
    ("diffuse_red", "diffuse_green", "diffuse_blue"): COLOURS,
    ("r", "g", "b"): COLOURS,
    ("normal_x", "normal_y", "normal_z"): NORMALS,
}

_UNIT = re.compile(r"\s*(\[[^\]]*\]|\([^)]*\))")
_TOKEN = re.compile(r"[A-Z]?[a-zäöü]+|[A-ZÄÖÜ]+|\d+")
#: Words of a name that say nothing of the axis: units, and whose coordinates they are.
_DECORATION = frozenset([
    "m", "mm", "cm", "dm", "km", "um", "in", "inch", "inches", "ft", "feet", "foot", "us", "metre",
    "metres", "meter", "meters", "coord", "coords", "coordinate", "coordinates", "koord",
    "koordinate", "pos", "position", "point", "points", "pt", "pts", "p", "vertex", "world",
    "local", "utm", "global", "scanner", "sensor", "lidar", "cartesian", "cart", "loc", "location",
])  # fmt: skip
#: Names of points as a whole, whose components are numbered from 0: ``Points_m_XYZ:0``.
_WHOLE = frozenset(["point", "points", "position", "coordinates", "coords"])
_SUFFIX = re.compile(r"^([xyz])(coord|coords|koord|pos)$")
_AXES = {
    "x": "x", "y": "y", "z": "z",
    "east": "east", "easting": "east", "e": "east", "rechtswert": "east",
    "north": "north", "northing": "north", "n": "north", "hochwert": "north",
    "up": "up", "height": "up", "h": "up", "elevation": "up", "elev": "up", "altitude": "up",
    "alt": "up", "hoehe": "up", "höhe": "up",
}  # fmt: skip
#: Axes that make a right-handed frame, the likelier first.
_FRAMES = (("x", "y", "z"), ("east", "north", "up"), ("x", "y", "up"), ("east", "north", "z"))
_RGB = ("r", "g", "b")
_COLOURS = dict(zip(_RGB, COLOURS, strict=True))
_KNOWN = {
    **{name: name for name in (*NORMALS, *COLOURS, "intensity")},
    "scalar_intensity": "intensity", "intensities": "intensity",
    **{
        other: usual
        for others, names in TRIPLES.items() if others != _RGB
        for other, usual in zip(others, names, strict=True)
    },
}  # fmt: skip
#: Names of the parts of a unit quaternion: a table that has them holds poses, not points.
QUATERNION = frozenset(["qw", "qx", "qy", "qz"])


def clean(name: str) -> str:
    """A name without quotes, marks of comments and units in brackets."""
    return _UNIT.sub("", name.strip().strip("\"'").lstrip("#/%!")).strip().strip("\"'")


def axes_named(names: Sequence[str]) -> tuple[int, int, int] | None:
    """The columns that are x, y and z by their names, in any of the ways to write these.

    Easting, northing and height are x, y and z. Where several columns will do, those count that
    have nothing besides the axis in their names, then those whose names go together.

    Parameters
    ----------
    names : sequence of str
        Of all columns, in order: ``X[mm]``, ``X_m``, ``Points_m_XYZ:0``, ``Easting``, ``//X``.

    Returns
    -------
    tuple of three positions, or None where the names tell no three.
    """
    found = [(column, *role) for column, name in enumerate(names) if (role := _role(name))]
    kinds = sorted(dict.fromkeys(decoration for _, _, decoration in found), key=len)
    for frame in _FRAMES:
        for kind in kinds:
            at = {axis: column for column, axis, words in reversed(found) if words == kind}
            if set(frame) <= set(at):
                return at[frame[0]], at[frame[1]], at[frame[2]]
    axes = [axis for _, axis, _ in found]
    for frame in _FRAMES:
        if all(axes.count(axis) == 1 for axis in frame):
            x, y, z = (found[axes.index(axis)][0] for axis in frame)
            return x, y, z
    return None


def coordinates_named(
    names: Sequence[str], whole: Collection[str]
) -> str | tuple[int, int, int] | None:
    """Where the coordinates are: the name of one array of several numbers, or three columns.

    Parameters
    ----------
    names : sequence of str
        Of all columns and arrays, in order.
    whole : collection of str
        Those that have several numbers for a point.
    """
    lower = {name.strip().lower(): name for name in reversed(names)}
    known = [lower[name] for name in POINTS if name in lower]
    called = next((name for name in known if name in whole), None)
    return called or axes_named(names) or next(iter(known), None)


def _role(name: str) -> tuple[str, tuple[str, ...]] | None:
    """Which axis a name means, and the words around it; None for other names."""
    words = [word.lower() for word in _TOKEN.findall(clean(name))]
    decoration = tuple(word for word in words if word in _DECORATION)
    rest = [word for word in words if word not in _DECORATION]
    if rest[:1] == ["xyz"] and len(rest) == 2:
        decoration, rest = (*decoration, "xyz"), rest[1:]
    numbered = bool({"xyz", *_WHOLE} & set(decoration))
    if len(rest) != 1:
        return None
    if numbered and rest[0] in ("0", "1", "2"):
        return "xyz"[int(rest[0])], decoration
    suffixed = _SUFFIX.match(rest[0])
    axis = suffixed[1] if suffixed else _AXES.get(rest[0])
    return (axis, decoration) if axis else None


def attribute_names(names: Sequence[str]) -> list[str]:
    """What the columns are called as attributes: of known ones as in PLY; each once.

    Columns without a name are called ``column_4``, counted from 1.
    """
    given = [clean(name) for name in names]
    lower = [name.lower() for name in given]
    colours = _COLOURS if set(_COLOURS) <= set(lower) else {}
    found: list[str] = []
    for column, (name, key) in enumerate(zip(given, lower, strict=True), 1):
        known = colours.get(key) or _KNOWN.get(key) or name or f"column_{column}"
        found.append(known if known not in found else f"{known}_{column}")
    return found


def split_heading(line: str, parts: Iterable[str]) -> list[list[str]]:
    """A line of names cut at each of `parts`, in turn; "" cuts at blanks."""
    bare = _UNIT.sub("", line.strip().lstrip("#/%!;").strip())
    found = []
    for part in parts:
        cells = [clean(cell) for cell in (bare.split(part) if part else bare.split())]
        if cells and cells[0].endswith(":"):  # "columns: x y z"
            cells = cells[1:]
        found.append(cells)
    return found


def with_usual_names(values: Mapping[str, Values]) -> dict[str, Values]:
    """The same attributes under the names that `PointCloud` has for them.

    Colours that PCL packs into one number, ``rgb`` or ``rgba``, are unpacked. What has a usual
    name already keeps it, and nothing is lost to a second one of that name.
    """
    found = dict(values)
    for others, usual in TRIPLES.items():
        if set(others) <= found.keys() and not set(usual) & found.keys():
            found = {
                dict(zip(others, usual, strict=True)).get(name, name): column
                for name, column in found.items()
            }
    for packed in ("rgb", "rgba"):
        if packed in found and found[packed].dtype.itemsize == 4 and not set(COLOURS) & set(found):
            bits = np.ascontiguousarray(found.pop(packed)).view(np.uint32)
            for name, shift in zip(COLOURS, (16, 8, 0), strict=True):
                found[name] = (bits >> shift & 255).astype(np.uint8)
            if packed == "rgba":
                found["alpha"] = (bits >> 24).astype(np.uint8)
    return found
