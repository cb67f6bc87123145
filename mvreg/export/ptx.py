"""Scans as PTX: points in the frame of the scanner, its pose in the header."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mvreg.export.model import Model
from mvreg.export.poses.text import rows, stems, words
from mvreg.io import PointCloud
from mvreg.io.cloud_stream import ROWS, replaced
from mvreg.types.attributes import COLOURS


def write_ptx(folder: Path, model: Model) -> list[str]:
    """``ptx/NAME.ptx``: one column of points per scan, in the frame of its file.

    The header has the scanner's position, its three axes, and the pose for row vectors, that is
    transposed: the translation is the last row.
    """
    names = stems(model.placements)
    remarks: list[str] = []
    for cloud in model.scans():
        pose = cloud.T_world_scan
        assert pose is not None
        values, said = _intensity(cloud)
        table: list[Any] = [*cloud.points.T, values]
        coloured = set(COLOURS) <= cloud.attributes.keys()
        if coloured:
            table += [_byte(cloud.attributes[name]) for name in COLOURS]
        path = folder / "ptx" / f"{names[cloud.name]}.ptx"
        with replaced(path) as part, part.open("w", encoding="ascii", newline="\r\n") as stream:
            # Columns, then rows: a scan that is no grid is one column.
            stream.write(f"1\n{len(cloud.points)}\n{words(pose[:3, 3])}\n")
            stream.write(rows(pose[:3, :3].T))
            stream.write(rows(pose.T))
            for first in range(0, len(cloud.points), ROWS):
                piece = [column[first : first + ROWS].tolist() for column in table]
                stream.writelines(
                    f"{' '.join(map(repr, row))}\n" for row in zip(*piece, strict=True)
                )
        remarks += [f"{path.name}: {each}" for each in said]
        left = cloud.attributes.keys() - {"intensity", *COLOURS}
        if left:
            remarks.append(f"{path.name}: PTX has no place for {', '.join(sorted(left))}")
    return remarks


def _intensity(cloud: PointCloud) -> tuple[Any, list[str]]:
    """Intensity from 0 to 1, as PTX has it; 0.5, for not known, where there is none."""
    values = cloud.attributes.get("intensity")
    if values is None:
        return np.full(len(cloud.points), 0.5), []
    values = np.nan_to_num(values.astype(np.float64))
    low, high = float(values.min()), float(values.max())
    if low >= 0 and high <= 1:
        return values, []
    span = high - low or 1.0
    return (values - low) / span, [f"intensity from {low:g} to {high:g} is written from 0 to 1"]


def _byte(values: Any) -> Any:
    return values if values.dtype.itemsize == 1 else (values >> 8).astype(np.uint8)
