"""The merged model: all points of the placed scans in one frame, with what is known of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
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


@dataclass(frozen=True, eq=False)
class PlacedScan:
    """One scan in the frame of the model; gone through, its points come in pieces, each time.

    Parameters
    ----------
    scan : Scan
        One of which only a part is held is read again each time, in full.
    number : int
        Among the scans of the run, from 0.
    pose : (4, 4) array
        ``T_model_scan``.
    kinds : mapping of str to dtype
        See `model_kinds`.
    view : View, optional
        As it was registered.
    residuals : (M,) array, optional
        Of the view's points.
    measured : bool
        Points have residuals; NaN without a view.
    """

    scan: Scan
    number: int
    pose: Array
    kinds: Mapping[str, np.dtype[Any]]
    view: View | None = None
    residuals: Array | None = None
    measured: bool = False

    @property
    def own_kinds(self) -> dict[str, np.dtype[Any]]:
        """The attributes that its points have, in the types of the model."""
        more = (RESIDUAL, INDEX) if self.measured else (INDEX,)
        return {name: self.kinds[name] for name in (*kinds_of(self.scan), *more)}

    def __iter__(self) -> Iterator[PointCloud]:
        for points, attributes in pieces_of(self.scan):
            values = {
                name: widened(name, column, self.kinds[name])
                for name, column in turned(attributes, self.pose[:3, :3]).items()
            }
            values[INDEX] = np.full(len(points), self.number, dtype=self.kinds[INDEX])
            if self.measured:
                values[RESIDUAL] = self._residuals(points)
            yield PointCloud(se3.apply(self.pose, points), attributes=values, name=self.scan.name)

    def _residuals(self, points: Array) -> Values:
        found = np.full(len(points), np.nan, dtype=self.kinds[RESIDUAL])
        if self.view is not None and self.residuals is not None:
            distances, indices = nearest(self.view.tree, points)
            found[:] = of_raw_points(self.residuals, indices, distances, self.view)
        return found


def placed_scans(
    scanset: ScanSet, poses: Mapping[str, Array], views: Sequence[View] = ()
) -> list[PlacedScan]:
    """The placed scans in the frame of the poses, in the order of the set.

    Parameters
    ----------
    scanset : ScanSet
    poses : mapping of str to (4, 4) array
        ``T_model_scan``.
    views : sequence of View
        As they were registered, to measure residuals by: the root mean square distance of the
        nearest registration point, NaN where it touches no other scan.
    """
    kinds = model_kinds(scanset, poses, views)
    residuals = point_residuals(poses, views)
    by_name = {view.name: view for view in views}
    return [
        PlacedScan(
            scan,
            number,
            poses[scan.name],
            kinds,
            by_name.get(scan.name),
            residuals.get(scan.name),
            bool(views),
        )
        for number, scan in enumerate(scanset.scans)
        if scan.name in poses
    ]


def model_clouds(
    scanset: ScanSet, poses: Mapping[str, Array], views: Sequence[View] = ()
) -> Iterator[PointCloud]:
    """All points of `placed_scans`; a large scan comes as several clouds, one after the other.

    Yields
    ------
    PointCloud
        Its name is the scan's; its attributes are in the types of `model_kinds`.

    Raises
    ------
    InputError
        If a file that is to be read again is not what it was.
    """
    return chain.from_iterable(placed_scans(scanset, poses, views))


def pieces_of(scan: Scan) -> Iterator[tuple[Array, Attributes]]:
    """All points of a scan, with their attributes, at once or in pieces."""
    if scan.full is None:
        yield scan.points, scan.attributes
    else:
        yield from scan.full.pieces()


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
