"""Read VTK's XML files of points and meshes: PolyData (.vtp) and UnstructuredGrid (.vtu)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from mvreg.errors import InputError, few
from mvreg.io.cloud import PointCloud
from mvreg.io.table import excerpt
from mvreg.io.vtk_arrays import NamedArray, attributes_of
from mvreg.io.vtk_cells import LINES, POLYGON, STRIP, Cells, surface
from mvreg.io.vtk_xml_arrays import TYPES, Appended, Arrays
from mvreg.types import Array
from mvreg.types.attributes import Values

_KINDS = ("PolyData", "UnstructuredGrid")
#: Lists of cells of a piece of PolyData, and the type of these.
_LISTS = {"Lines": LINES, "Strips": STRIP, "Polys": POLYGON}
_ROLES = {"Normals": "normals", "Scalars": "scalars"}
_APPENDED = re.compile(rb"<AppendedData\b([^>]*)>\s*_")


@dataclass
class _Piece:
    """Points (N, 3), the cells and arrays of these, and which data were left out."""

    points: Array
    cells: list[Cells] = field(default_factory=list)
    arrays: list[NamedArray] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


def read_vtk_xml(path: Path) -> PointCloud:
    """Read all pieces of a file, one after the other, as one scan.

    Data of points become attributes; polygons, strips and flat cells become triangles. What is
    left out, data of cells and cells without a surface, a remark says.

    Raises
    ------
    InputError
        With file, array and reason; what is compressed by LZ4, which Python lacks, is refused.
    """
    root, appended = _parsed(path.read_bytes(), path)
    kind = root.get("type", "")
    if root.tag != "VTKFile" or kind not in _KINDS:
        raise InputError(
            f"{path}: expected a VTKFile of type {', '.join(_KINDS)}; got {excerpt(root.tag)} of "
            f"type {excerpt(kind)}; files of other types are no scans or, as those that name the "
            "files of their pieces, hold none: leave this file out"
        )
    arrays = Arrays.of(root, appended, path)
    pieces = [_piece(each, arrays) for each in root.iterfind(f"{kind}/Piece")]
    pieces = [each for each in pieces if len(each.points)]
    if not pieces:
        raise InputError(f"{path}: expected points, found none; leave this file out")
    return _joined(pieces, [each.get("Name", "") for each in root.iterfind(f"{kind}/FieldData/*")])


def _parsed(data: bytes, path: Path) -> tuple[Element, Appended]:
    """The elements, and what is appended to them, which may be no XML."""
    found = _APPENDED.search(data)
    text, raw = data, False
    appended = b""
    if found:
        end = data.rfind(b"</AppendedData")
        appended = data[found.end() : end if end > found.end() else len(data)]
        raw = b"raw" in found[1].lower()
        text = data[: found.start()] + b"</VTKFile>"
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise InputError(f"{path}: expected a VTKFile without entities of its own, found some")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(
            f"{path}: expected XML as VTK writes it: {error}; the file is truncated or damaged"
        ) from error
    offsets = [each.get("offset", "") for each in root.iter("DataArray")]
    starts = sorted({int(each) for each in offsets if each.isdecimal() and len(each) < 16})
    return root, Appended(appended, raw, starts)


def _piece(piece: Element, arrays: Arrays) -> _Piece:
    element = piece.find("Points/DataArray")
    if element is None:
        return _Piece(np.empty((0, 3)))
    points = arrays.values(element)
    count = piece.get("NumberOfPoints", "")
    if points.shape[1] != 3 or str(len(points)) != count:
        raise InputError(
            f"{arrays.path}: expected the coordinates of {count} points, 3 each, got an array "
            f"{points.shape}; the file is truncated or damaged"
        )
    found = _Piece(points.astype(np.float64))
    for name, kind in (*_LISTS.items(), ("Cells", None)):
        found.cells += _cells(piece.find(name), kind, arrays, len(points))
    _add_arrays(piece.find("PointData"), arrays, found)
    found.left_out += [each.get("Name", "") for each in piece.iterfind("CellData/*")]
    return found


def _add_arrays(data: Element | None, arrays: Arrays, found: _Piece) -> None:
    """The data of points, but for strings and what is called as another array."""
    if data is None:
        return
    roles = {data.get(key, ""): role for key, role in _ROLES.items()}
    for each in data:
        name = each.get("Name", "")
        if each.get("type") in TYPES and name not in {known.name for known in found.arrays}:
            values = arrays.values(each, len(found.points))
            found.arrays.append(NamedArray(name, values, roles.get(name, "")))
        else:
            found.left_out.append(name)


def _cells(
    element: Element | None, kind: int | None, arrays: Arrays, points: int
) -> Iterator[Cells]:
    """The cells of one list; of any type where it is not told beforehand."""
    if element is None:
        return
    by_name = {each.get("Name"): each for each in element}
    if not {"connectivity", "offsets"} <= by_name.keys():
        return
    names = ("connectivity", "offsets", *(() if kind else ("types",)))
    if not set(names) <= by_name.keys():
        raise InputError(f"{arrays.path}: expected cells with {', '.join(names)}")
    read = [arrays.values(by_name[name]).reshape(-1).astype(np.int64) for name in names]
    yield Cells(read[0], read[1], kind or read[2]).checked(points, f"{arrays.path}, {element.tag}")


def _joined(pieces: list[_Piece], of_file: list[str]) -> PointCloud:
    common = set.intersection(*({each.name for each in piece.arrays} for piece in pieces))
    left_out = [name for piece in pieces for name in piece.left_out]
    left_out += [a.name for piece in pieces for a in piece.arrays if a.name not in common]
    arrays = [
        NamedArray(first.name, np.concatenate(parts), first.role)
        for first in pieces[0].arrays
        if len(parts := _same(pieces, first)) == len(pieces)
    ]
    left_out += sorted(common - {each.name for each in arrays})
    remarks = [f"left out data of cells or of some points: {few([*dict.fromkeys(left_out)])}"]
    remarks = remarks if left_out else []
    if of_file:
        remarks.append(f"left out data of the whole file: {few(of_file)}")
    starts = np.cumsum([0, *(len(piece.points) for piece in pieces)]).tolist()
    moved = [
        replace(each, corners=each.corners + start)
        for piece, start in zip(pieces, starts, strict=False)
        for each in piece.cells
    ]
    triangles, lost = surface(moved)
    return PointCloud(
        np.concatenate([piece.points for piece in pieces]),
        attributes=attributes_of(arrays),
        triangles=triangles,
        remarks=(*remarks, *lost),
    )


def _same(pieces: list[_Piece], first: NamedArray) -> list[Values]:
    """The arrays of all pieces that have the name and the components of one."""
    return [
        each.values
        for piece in pieces
        for each in piece.arrays
        if each.name == first.name and each.values.shape[1] == first.values.shape[1]
    ]
