"""Write clouds as binary PCD, piece by piece."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.io.cloud import PointCloud
from mvreg.io.cloud_stream import ROWS, numbered, replaced, rows_of
from mvreg.types.attributes import COLOURS, Values

#: PCL's names of what `PointCloud` calls differently.
NAMES = {"nx": "normal_x", "ny": "normal_y", "nz": "normal_z"}


def write_pcd_clouds(
    path: str | Path, clouds: Iterable[PointCloud], kinds: Mapping[str, np.dtype[Any]]
) -> list[str]:
    """Write clouds into one file, one after the other; only one need be in memory at a time.

    Coordinates are doubles, bit for bit. Colours are packed into ``rgb``, a byte each in a number
    of four, as PCL has them; normals and intensity are floats of four bytes, which is what PCL's
    own types hold; other attributes keep their type.

    Parameters
    ----------
    path : str or Path
        Missing folders are made; an existing file is replaced.
    clouds : iterable of PointCloud
        A cloud that lacks an attribute gets NaN, or 0 where the type is whole.
    kinds : mapping of str to dtype
        The attributes and their types.

    Returns
    -------
    list of str
        What could not be kept, in words.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    path = Path(path)
    packed = set(COLOURS) <= kinds.keys()
    fields = {"rgb": np.dtype("<u4")} if packed else {}
    fields |= {n: _kind(n, k) for n, k in kinds.items() if not (packed and n in COLOURS)}
    labels = _labels(fields)
    record = np.dtype([*((label, "<f8") for label in "xyz"),
                       *((label, fields[name]) for name, label in labels.items())])  # fmt: skip
    count = 0
    with replaced(path) as part, part.open("w+b") as stream:
        stream.write(_header(record, 0))
        for cloud in clouds:
            for first in range(0, len(cloud.points), ROWS):
                rows = _rows(cloud, slice(first, first + ROWS), record, labels, kinds)
                stream.write(rows.tobytes())
            count += len(cloud.points)
        stream.seek(0)
        stream.write(_header(record, count))
    wide = packed and any(kinds[name].itemsize > 1 for name in COLOURS)
    return [f"{path.name}: PCD has colours of 8 bits; the lower 8 of 16 are left out"] * wide


def _kind(name: str, kind: np.dtype[Any]) -> np.dtype[Any]:
    if name in NAMES or (name == "intensity" and kind.itemsize <= 2):
        return np.dtype("<f4")
    if kind.kind == "b":
        return np.dtype("u1")
    return np.dtype("<f4") if kind.itemsize < 4 and kind.kind == "f" else kind.newbyteorder("<")


def _labels(fields: Iterable[str]) -> dict[str, str]:
    """The names of the fields: one word each, none twice."""
    found: dict[str, str] = {}
    for name in fields:
        word = re.sub(r"[^!-~]+", "_", NAMES.get(name, name)).strip("_") or "scalar"
        found[name] = numbered(word, {"x", "y", "z", *found.values()})
    return found


def _rows(
    cloud: PointCloud,
    piece: slice,
    record: np.dtype[Any],
    labels: Mapping[str, str],
    kinds: Mapping[str, np.dtype[Any]],
) -> Values:
    table = rows_of(cloud, piece, record, labels)
    if "rgb" in labels and "rgb" not in kinds and set(COLOURS) <= cloud.attributes.keys():
        table[labels["rgb"]] = _packed(cloud, piece, kinds["red"])
    return table


def _packed(cloud: PointCloud, piece: slice, kind: np.dtype[Any]) -> Values:
    bits = np.zeros(len(cloud.points[piece]), dtype=np.uint32)
    for name, shift in zip(COLOURS, (16, 8, 0), strict=True):
        values = cloud.attributes[name][piece].astype(np.uint32)
        bits |= (values >> np.uint32(8 * (kind.itemsize - 1)) & np.uint32(255)) << np.uint32(shift)
    return bits


def _header(record: np.dtype[Any], count: int) -> bytes:
    """The header, of one length whatever the count: a comment fills it up."""
    labels = record.names or ()
    # PCL takes "rgb" as a float whose bits are the colours.
    types = ["F" if label == "rgb" else record[label].kind.upper() for label in labels]
    lines = [
        f"# .PCD v0.7 - written by mvreg{' ' * 2 * (15 - len(str(count)))}",
        "VERSION 0.7",
        f"FIELDS {' '.join(labels)}",
        f"SIZE {' '.join(str(record[label].itemsize) for label in labels)}",
        f"TYPE {' '.join(types)}",
        f"COUNT {' '.join('1' for _ in labels)}",
        f"WIDTH {count}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {count}",
        "DATA binary",
        "",
    ]
    return "\n".join(lines).encode("ascii")
