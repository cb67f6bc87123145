"""Arrays of VTK's files as attributes of points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.io.cloud_stream import numbered
from mvreg.io.ply_header import usual
from mvreg.types.attributes import COLOURS, NORMALS, Values
from mvreg.types.colours import as_bytes, colours
from mvreg.types.column_names import with_usual_names

#: What programs call an array of colours.
_COLOURED = frozenset(["rgb", "rgba", "color", "colors", "colour", "colours", "rgbcolor",
                       "rgbcolors", "vertexcolors", "point_colors"])  # fmt: skip


@dataclass(frozen=True, eq=False)
class NamedArray:
    """One array of points.

    Parameters
    ----------
    name : str
    values : (N, K) array
        K components of N points.
    role : str
        ``normals``, ``colours``, ``scalars`` for those that VTK colours by, or empty.
    """

    name: str
    values: Values
    role: str = ""


def attributes_of(arrays: Sequence[NamedArray]) -> dict[str, Values]:
    """Attributes (N,) by name: normals and colours as PLY calls them, of others ``NAME_0``, ....

    Of several arrays of normals or colours the first with the role counts, or else the first that
    is called so; the others keep their names.
    """
    normals = _first([a for a in arrays if _may_be_normals(a)], "normals")
    coloured = [(a, found) for a in arrays if (found := _colours_in(a))]
    colour = _first([a for a, _ in coloured], "colours")
    attributes: dict[str, Values] = {}
    for each in arrays:
        if each is normals:
            found = {n: each.values[:, i].copy() for i, n in enumerate(NORMALS)}
        elif each is colour:
            found = next(found for a, found in coloured if a is each)
        elif each.values.shape[1] == 1:
            found = {usual(each.name): each.values[:, 0].copy()}
        else:
            columns = enumerate(each.values.T)
            found = {f"{each.name}_{i}": column.copy() for i, column in columns}
        for name, values in found.items():
            attributes[numbered(name, [*attributes, "x", "y", "z"])] = values
    return with_usual_names(attributes)


def _first(arrays: Sequence[NamedArray], role: str) -> NamedArray | None:
    return next((each for each in arrays if each.role == role), arrays[0] if arrays else None)


def _may_be_normals(array: NamedArray) -> bool:
    called = array.role == "normals" or array.name.lower() in ("normals", "normal")
    return called and array.values.shape[1] == 3 and array.values.dtype.kind == "f"


def _colours_in(array: NamedArray) -> dict[str, Values]:
    """The colours of an array, if it holds any: of bytes that VTK colours by, or called so.

    VTK shows three or four bytes of a point as they are; other numbers become a colour by a table.
    """
    count = array.values.shape[1]
    called = array.role == "colours" or array.name.lower().replace(" ", "") in _COLOURED
    shown = array.role == "scalars" and array.values.dtype == np.uint8
    if count not in (3, 4) or not (called or shown):
        return {}
    if array.values.dtype in (np.uint8, np.uint16):
        return dict(zip((*COLOURS, "alpha"), array.values.T.copy(), strict=False))
    whole = as_bytes(array.values.astype(np.float64))
    found = colours(whole[:, :3])
    return found | ({"alpha": whole[:, 3].astype(np.uint8)} if found and count == 4 else {})
