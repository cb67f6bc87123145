"""The merged model: all points of the placed scans in one frame, with what is known of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mvreg.evaluation.residuals import of_raw_points, point_residuals
from mvreg.geometry import se3
from mvreg.geometry.nearest import nearest
from mvreg.io import PointCloud
from mvreg.types import Array, Scan, ScanSet, View
from mvreg.types.attributes import COLOURS, Attributes, Values, turned

#: The number of a point's scan among the scans of the run, from 0, in the order of the report.
INDEX = "scan_index"
#: How far a point lies from the surfaces of the other scans (length), where that was measured.
RESIDUAL = "residual"


def model_kinds(
    scanset: ScanSet, poses: Mapping[str, Array], views: Sequence[View] = ()
) -> dict[str, np.dtype[Any]]:
    """The attributes of the model by name: those of any placed scan, and `INDEX`.

    With the views that were registered also `RESIDUAL`.

    The type of one holds the values of all scans. Colours of 8 and 16 bits become 16 bits.
    """
    found: dict[str, np.dtype[Any]] = {}
    for scan in placed(scanset, poses):
        for name, kind in kinds_of(scan).items():
            found[name] = np.result_type(found[name], kind) if name in found else kind
    measured = {RESIDUAL: np.dtype(np.float32)} if views else {}
    return (
        found
        | measured
        | {INDEX: np.dtype(np.uint16 if len(scanset.scans) < 1 << 16 else np.uint32)}
    )


def model_clouds(
    scanset: ScanSet,
    poses: Mapping[str, Array],
    views: Sequence[View] = (),
    pieces: bool = False,
) -> Iterator[PointCloud]:
    """The placed scans in the frame of the poses, one at a time, in the order of the set.

    Parameters
    ----------
    scanset : ScanSet
        Scans of which only a part is held are read again, in full.
    poses : mapping of str to (4, 4) array
        ``T_model_scan``.
    views : sequence of View
        As they were registered, to measure residuals by: the root mean square distance of the
        nearest registration point, NaN where it touches no other scan.
    pieces : bool
        A scan that is read again may come as several clouds, one after the other.

    Yields
    ------
    PointCloud
        Its name is the scan's; its attributes are in the types of `model_kinds`.

    Raises
    ------
    InputError
        If a file that is to be read again is not what it was.
    """
    kinds = model_kinds(scanset, poses, views)
    residuals = point_residuals(poses, views)
    by_name = {view.name: view for view in views}
    numbers = {scan.name: number for number, scan in enumerate(scanset.scans)}
    for scan in placed(scanset, poses):
        pose, view = poses[scan.name], by_name.get(scan.name)
        for points, attributes in _points_of(scan, pieces):
            values = {
                name: widened(name, column, kinds[name])
                for name, column in turned(attributes, pose[:3, :3]).items()
            }
            values[INDEX] = np.full(len(points), numbers[scan.name], dtype=kinds[INDEX])
            if views:
                values[RESIDUAL] = np.full(len(points), np.nan, dtype=kinds[RESIDUAL])
            if view is not None and scan.name in residuals:
                distances, indices = nearest(view.tree, points)
                values[RESIDUAL][:] = of_raw_points(residuals[scan.name], indices, distances, view)
            yield PointCloud(se3.apply(pose, points), attributes=values, name=scan.name)


def _points_of(scan: Scan, pieces: bool) -> Iterator[tuple[Array, Attributes]]:
    """All points of a scan, at once or in pieces."""
    if scan.full is None:
        yield scan.points, scan.attributes
    elif pieces:
        yield from scan.full.pieces()
    else:
        yield scan.full()


def placed(scanset: ScanSet, poses: Mapping[str, Array]) -> list[Scan]:
    """The scans that have a pose."""
    return [scan for scan in scanset.scans if scan.name in poses]


def kinds_of(scan: Scan) -> dict[str, np.dtype[Any]]:
    """The types of a scan's attributes by name."""
    if scan.full is not None:
        return dict(scan.full.kinds)
    return {name: values.dtype for name, values in scan.attributes.items()}


def widened(name: str, values: Values, kind: np.dtype[Any]) -> Values:
    """Values in the type of the model; colours of 8 bits spread over 16, so that white stays so."""
    if name in COLOURS and values.dtype == np.uint8 and kind == np.uint16:
        return values.astype(kind) * np.uint16(257)
    return values.astype(kind, copy=False)
