"""Write scans as E57, each in a frame of its own with its pose, by libE57 in pye57."""

from __future__ import annotations

import uuid
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io.cloud import PointCloud
from mvreg.io.cloud_stream import ROWS, Survey, numbered, replaced
from mvreg.io.e57_header import NAMES
from mvreg.types.attributes import COLOURS, Values

#: E57's names, from those of `PointCloud`; normals are an extension that libE57 describes.
FIELDS = {"intensity": "intensity"} | {name: field for field, name in NAMES.items()}
EXTENSIONS = {
    "nor": "http://www.libe57.org/E57_NOR_surface_normals.txt",
    "mvreg": "urn:mvreg:attributes",
}


def require_pye57() -> Any:
    """The module pye57.

    Raises
    ------
    InputError
        If it is not installed; says how to install it.
    """
    try:
        import pye57
    except ImportError as error:
        raise InputError(
            f"E57 needs pye57, which cannot be imported ({error}): pip install 'mvreg[e57]'"
        ) from None
    return pye57


def write_e57_scans(path: str | Path, scans: Iterable[Iterable[PointCloud]]) -> None:
    """Write scans into one file, one after the other; only a piece need be in memory at a time.

    Coordinates are doubles, bit for bit, in the frame of each scan; the pose ``T_world_scan`` is in
    its header. Attributes that E57 has no name for are in an extension of the name ``mvreg``.

    Parameters
    ----------
    path : str or Path
        Missing folders are made; an existing file is replaced.
    scans : iterable of iterables of PointCloud
        Each scan as its pieces, of the same attributes; gone through twice. The first one has the
        name of the scan, and `T_world_scan`; without that the pose is left out.

    Raises
    ------
    InputError
        If pye57 is missing, or the file cannot be written.
    """
    pye57 = require_pye57()
    path = Path(path)
    with replaced(path) as part:
        file = pye57.E57(str(part), mode="w")
        try:
            for prefix, uri in EXTENSIONS.items():
                file.image_file.extensionsAdd(prefix, uri)
            for scan in scans:
                _write_scan(file, scan)
        finally:
            file.close()


def _write_scan(file: Any, pieces: Iterable[PointCloud]) -> None:
    from pye57 import libe57

    image = file.image_file
    seen, scan = Survey(), None
    for piece in pieces:
        seen.add(piece)
        scan = piece.chosen(np.arange(0)) if scan is None else scan
    if scan is None:
        return
    node = libe57.StructureNode(image)
    node.set("guid", libe57.StringNode(image, f"{{{uuid.uuid4()}}}"))
    node.set("name", libe57.StringNode(image, scan.name))
    if seen.count:
        corners = (("Minimum", seen.lower), ("Maximum", seen.upper))
        _set_numbers(image, node, "cartesianBounds", {
            f"{axis}{end}": value for end, corner in corners
            for axis, value in zip("xyz", corner, strict=True)
        })  # fmt: skip
    if set(COLOURS) <= scan.attributes.keys():
        top = 255 if all(scan.attributes[name].dtype == np.uint8 for name in COLOURS) else 65535
        limits = {f"{FIELDS[name]}Minimum": 0 for name in COLOURS}
        limits |= {f"{FIELDS[name]}Maximum": top for name in COLOURS}
        _set_numbers(image, node, "colorLimits", limits)
    if "intensity" in seen.limits:
        low, high = seen.limits["intensity"]
        _set_numbers(image, node, "intensityLimits",
                     {"intensityMinimum": low, "intensityMaximum": high})  # fmt: skip
    if scan.T_world_scan is not None:
        quaternion = se3.quaternion(scan.T_world_scan[:3, :3])
        pose = libe57.StructureNode(image)
        node.set("pose", pose)
        # In this order: some readers go by it, not by the names.
        _set_numbers(
            image, pose, "rotation", dict(zip("wxyz", np.roll(quaternion, 1), strict=True))
        )
        _set_numbers(
            image, pose, "translation", dict(zip("xyz", scan.T_world_scan[:3, 3], strict=True))
        )
    prototype = libe57.StructureNode(image)
    columns: dict[str, Values] = {}
    for axis in "XYZ":
        prototype.set(f"cartesian{axis}", libe57.FloatNode(image, 0.0, libe57.E57_DOUBLE))
        columns[f"cartesian{axis}"] = np.empty(0)
    labels: dict[str, str] = {}
    for name, values in scan.attributes.items():
        labels[name] = _label(name, columns)
        columns[labels[name]] = values.astype(np.uint8) if values.dtype.kind == "b" else values
        between = seen.limits.get(name, (0, 0))
        prototype.set(labels[name], _prototype(image, columns[labels[name]].dtype, between))
    points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
    node.set("points", points)
    file.data3d.append(node)
    _write_points(image, points, pieces, labels, columns)


def _set_numbers(image: Any, parent: Any, name: str, values: Mapping[str, float]) -> None:
    from pye57 import libe57

    node = libe57.StructureNode(image)
    parent.set(name, node)
    for key, value in values.items():
        whole = isinstance(value, int)
        node.set(
            key,
            libe57.IntegerNode(image, value) if whole else libe57.FloatNode(image, float(value)),
        )


def _prototype(image: Any, kind: np.dtype[Any], limits: tuple[float, float]) -> Any:
    from pye57 import libe57

    if kind.kind == "f":
        return libe57.FloatNode(
            image, 0.0, libe57.E57_SINGLE if kind.itemsize <= 4 else libe57.E57_DOUBLE
        )
    # Colours fill their type, so that white is white; others take the bits that they need.
    if kind.kind == "u" and kind.itemsize <= 2:
        limits = 0, int(np.iinfo(kind).max)
    low, high = (int(each) for each in limits)
    return libe57.IntegerNode(image, low, low, high)


def _label(name: str, taken: Mapping[str, Values]) -> str:
    """A name in E57: an XML name, with the prefix of the extension where it is not E57's own."""
    if name in FIELDS:
        return FIELDS[name]
    word = "".join(c if c.isascii() and (c.isalnum() or c in "_-.") else "_" for c in name)
    return numbered(f"mvreg:{word if word[:1].isalpha() else f'_{word}'}", taken)


def _write_points(
    image: Any,
    points: Any,
    pieces: Iterable[PointCloud],
    labels: Mapping[str, str],
    columns: Mapping[str, Values],
) -> None:
    """Write all pieces; `columns` are of the types that they have, by label."""
    from pye57 import libe57

    # libE57 takes no unsigned types beyond 32 bits.
    kinds = {"u8": "i8", "f2": "f4"}
    room = {
        label: np.empty(ROWS, dtype=kinds.get(values.dtype.str[1:], values.dtype.str[1:]))
        for label, values in columns.items()
    }
    buffers = libe57.VectorSourceDestBuffer()
    for label, values in room.items():
        buffers.append(libe57.SourceDestBuffer(image, label, values, ROWS, True, True))
    writer = points.writer(buffers)
    for piece in pieces:
        for first in range(0, len(piece.points), ROWS):
            which = slice(first, first + ROWS)
            size = len(piece.points[which])
            for axis, column in zip("XYZ", piece.points[which].T, strict=True):
                room[f"cartesian{axis}"][:size] = column
            for name, label in labels.items():
                room[label][:size] = piece.attributes[name][which]
            writer.write(size)
    writer.close()
