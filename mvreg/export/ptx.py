"""Scans as PTX: points in the frame of the scanner, its pose in the header."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.export.model import Model
from mvreg.export.poses.text import rows, stems, words
from mvreg.io import PointCloud
from mvreg.io.cloud_stream import ROWS, replaced
from mvreg.report.input_rows import number_of_points
from mvreg.report.model import kinds_of
from mvreg.types import Array
from mvreg.types.attributes import COLOURS

#: The intensity of what has none, as PTX has it.
UNKNOWN = 0.5


def write_ptx(folder: Path, model: Model) -> list[str]:
    """``ptx/NAME.ptx``: one column of points per scan, in the frame of its file.

    The header has the scanner's position, its three axes, and the pose for row vectors, that is
    transposed: the translation is the last row.
    """
    names = stems(model.placements)
    remarks: list[str] = []
    for scan in model.scans():
        path = folder / "ptx" / f"{names[scan.scan.name]}.ptx"
        kinds = kinds_of(scan.scan)
        low, high = _intensities(scan) if "intensity" in kinds else (UNKNOWN, UNKNOWN)
        coloured = set(COLOURS) <= kinds.keys()
        with replaced(path) as part, part.open("w", encoding="ascii", newline="\r\n") as stream:
            # Columns, then rows: a scan that is no grid is one column.
            pose = scan.T_model_scan
            stream.write(f"1\n{number_of_points(scan.scan)}\n{words(pose[:3, 3])}\n")
            stream.write(rows(pose[:3, :3].T))
            stream.write(rows(pose.T))
            for cloud in scan:
                table: list[Any] = [*cloud.points.T, _intensity(cloud, low, high)]
                if coloured:
                    table += [_byte(cloud.attributes[name]) for name in COLOURS]
                for first in range(0, len(cloud.points), ROWS):
                    piece = [column[first : first + ROWS].tolist() for column in table]
                    stream.writelines(
                        f"{' '.join(map(repr, row))}\n" for row in zip(*piece, strict=True)
                    )
        if not _fits(low, high):
            remarks.append(
                f"{path.name}: intensity from {low:g} to {high:g} is written from 0 to 1"
            )
        left = kinds.keys() - {"intensity", *COLOURS}
        if left:
            remarks.append(f"{path.name}: PTX has no place for {', '.join(sorted(left))}")
    return remarks


def _intensities(scan: Iterable[PointCloud]) -> tuple[float, float]:
    """The least and the largest intensity, as `_known` has it; a large scan is read for it."""
    low, high = np.inf, -np.inf
    for cloud in scan:
        values = _known(cloud)
        low, high = float(values.min(initial=low)), float(values.max(initial=high))
    return low, high


def _known(cloud: PointCloud) -> Array:
    """Intensities (N,); `UNKNOWN` where the scan has none, and 0 of single points."""
    values = cloud.attributes.get("intensity")
    if values is None:
        return np.full(len(cloud.points), UNKNOWN)
    return np.nan_to_num(values.astype(np.float64))


def _fits(low: float, high: float) -> bool:
    return low >= 0 and high <= 1


def _intensity(cloud: PointCloud, low: float, high: float) -> Array:
    """Intensity from 0 to 1, as PTX has it."""
    values = _known(cloud)
    return values if _fits(low, high) else (values - low) / (high - low or 1.0)


def _byte(values: Any) -> Any:
    return values if values.dtype.itemsize == 1 else (values >> 8).astype(np.uint8)
