"""Raw range scans and sets of them, as they come from files.

Checked once, when they are made; all else may then rely on finite coordinates. Public as part of
`mvreg.types`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.geometry.arrays import Array
from mvreg.types import checks
from mvreg.types.attributes import Attributes, FullPoints, Values, turned
from mvreg.types.inputs import Input
from mvreg.types.lazy import FieldsAlone, Latest, lazy
from mvreg.types.pointlike import PointLike, points_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from mvreg.kernels.tree import Tree

#: Trees over more points than this, of 44 bytes a point, are not all kept: to build one takes less
#: than what is asked of it.
MANY = 200_000
LATEST = Latest("tree")
#: Raw points of all scans whose trees are kept once they have been asked: 100 MB. Those of more are
#: built again by what asks for them, and take a third of what is kept of a scan.
HELD_IN_TREES = 2_000_000


@dataclass(frozen=True, eq=False)
class Scan(FieldsAlone):
    """Raw points of one range scan, in a frame of their own.

    Parameters
    ----------
    name : str
        Unique within a set; the file's name where there is one.
    points : (N, 3) array, or what looks like points
        Finite coordinates, N >= 1. Arrays of any type and order, lists, tensors, data frames, and
        clouds and meshes of Open3D and trimesh will do, see `mvreg.types.PointLike`; the attribute
        is an array of doubles.
    view_direction : (3,) array, optional
        Unit vector from the surface towards the sensor, for a sensor far away or orthographic.
    view_point : (3,) array, optional
        The sensor's position, for a central projection.
    up : (3,) array, optional
        Unit vector against gravity, where the sensor was levelled; poses keep to it.
    initial : (4, 4) array, optional
        ``T_world_scan`` as known beforehand, from somewhere else: a pose to be tried.
    fixed : bool
        `initial` is the pose that the scan has, and keeps.
    attributes : mapping of str to (N,) array
        Colours (red, green, blue), intensity, normals (nx, ny, nz) and other scalars of the points.
        Registration does not use them; the model has them. Those that come with the points are
        kept, too; where both have one, this one counts.
    full : FullPoints, optional
        Where `points` are a part of what was scanned: the way to all of it, for the model.

    Raises
    ------
    InputError
        If the points are not (N, 3), not finite or none at all; if an attribute is not (N,).
    """

    if TYPE_CHECKING:  # what it takes is more than what it has

        def __init__(
            self,
            name: str,
            points: PointLike,
            view_direction: ArrayLike | None = None,
            view_point: ArrayLike | None = None,
            up: ArrayLike | None = None,
            initial: ArrayLike | None = None,
            fixed: bool = False,
            attributes: Attributes = ...,
            full: FullPoints | None = None,
        ) -> None: ...

    name: str
    points: Array
    view_direction: Array | None = None
    view_point: Array | None = None
    up: Array | None = None
    initial: Array | None = None
    fixed: bool = False
    attributes: Attributes = field(default_factory=dict, metadata={"stored": False})
    full: FullPoints | None = field(default=None, metadata={"stored": False})

    def __post_init__(self) -> None:
        points, told = points_of(self.name, self.points)
        if told:
            object.__setattr__(self, "attributes", {**told, **self.attributes})
        if len(points) == 0:
            raise InputError(f"scan {self.name!r}: expected at least one point, got none")
        if not np.isfinite(points).all():
            bad = int((~np.isfinite(points).all(axis=1)).sum())
            raise InputError(
                f"scan {self.name!r}: {bad} of {len(points)} points are NaN or infinite; "
                "drop them first"
            )
        points.flags.writeable = False  # the trees and the views share them
        object.__setattr__(self, "points", points)
        if self.initial is not None:
            initial = checks.named_poses("Scan.initial", {self.name: self.initial})[self.name]
            object.__setattr__(self, "initial", initial)
        elif self.fixed:
            raise InputError(f"scan {self.name!r}: expected the pose of a fixed scan, got none")
        for key, values in self.attributes.items():
            if np.shape(values) != (len(points),):
                raise InputError(
                    f"scan {self.name!r}: expected attribute {key!r} of {len(points)} points, got "
                    f"an array {np.shape(values)}"
                )
        for key in ("view_direction", "view_point", "up"):
            vector = getattr(self, key)
            if vector is None:
                continue
            vector = np.array(vector, dtype=np.float64)
            if vector.shape != (3,) or not np.isfinite(vector).all():
                raise InputError(f"scan {self.name!r}: expected {key} of 3 numbers, got {vector}")
            object.__setattr__(self, key, vector)
        for key in ("view_direction", "up"):
            if (vector := getattr(self, key)) is None:
                continue
            norm = np.linalg.norm(vector)
            if norm == 0:
                raise InputError(f"scan {self.name!r}: {key} is the zero vector")
            object.__setattr__(self, key, vector / norm)

    @lazy
    def tree(self) -> Tree:
        """k-d tree over `points`; of many points it is kept until other scans build theirs."""
        from mvreg.geometry.nearest import build_tree

        if len(self.points) > MANY:
            LATEST.add(self)
        return build_tree(self.points)

    @lazy
    def spacing(self) -> float:
        """Mean distance of a point to the nearest other one (length), `nearest.mean_spacing`."""
        from mvreg.geometry.nearest import mean_spacing

        return mean_spacing(self.points, self.tree)

    @property
    def knows_sensor(self) -> bool:
        """Whether the sensor's direction or position is known."""
        return self.view_direction is not None or self.view_point is not None

    def moved(self, transform: Array) -> Scan:
        """The same scan in another frame: points, sensor and vertical move together."""
        direction, point, up = self.view_direction, self.view_point, self.up
        return replace(
            self,
            points=se3.apply(transform, self.points),
            view_direction=None if direction is None else transform[:3, :3] @ direction,
            view_point=None if point is None else se3.apply(transform, point[None])[0],
            up=None if up is None else transform[:3, :3] @ up,
            initial=None if self.initial is None else self.initial @ se3.invert(transform),
            attributes=turned(self.attributes, transform[:3, :3]),
            full=None if self.full is None else Moved(self.full, transform),
        )

    def chosen(self, which: Values) -> Scan:
        """The points that a mask (N,) or indices (M,) choose, with their attributes."""
        return replace(
            self,
            points=self.points[which],
            attributes={name: values[which] for name, values in self.attributes.items()},
        )


@dataclass(frozen=True, eq=False)
class Moved:
    """`FullPoints` in another frame; `transform` (4, 4) leads there from theirs."""

    full: FullPoints
    transform: Array

    @property
    def count(self) -> int:
        """As theirs."""
        return self.full.count

    @property
    def kinds(self) -> Mapping[str, np.dtype[Any]]:
        """As theirs."""
        return self.full.kinds

    def __call__(self) -> tuple[Array, Attributes]:
        """Read and move them."""
        return self._moved(*self.full())

    def pieces(self) -> Iterator[tuple[Array, Attributes]]:
        """Read and move them, some at a time."""
        return (self._moved(*piece) for piece in self.full.pieces())

    def _moved(self, points: Array, attributes: Attributes) -> tuple[Array, Attributes]:
        return se3.apply(self.transform, points), turned(attributes, self.transform[:3, :3])


@dataclass(frozen=True, eq=False)
class ScanSet:
    """What a data set hands over: scans in the order given, and the truth where it is known.

    `poses` maps scan names to ground truth ``T_world_scan`` (4, 4); it may miss scans.
    `unit` is the unit of length ("mm"), or "file" for the files' own, whatever it is.
    `objects` maps scan names to the name of the object that they show, each of which has a world
    frame of its own: poses of different objects do not compare, and a result that puts two of
    them into one frame is wrong. None where all scans are of one object.
    `motions` maps the names of scans that were moved since they were read to ``T_scan_read``
    (4, 4): errors are reported for the frames that the files have.
    `sensors` maps the names of scans whose sensor the ``file`` or the ``user`` told to that word.
    `initial` maps the names of scans whose files give a pose to that ``T_world_scan`` (4, 4).
    `sources` maps the names of scans to the file that each is from, and its position in it, from 0.
    `remarks` are sentences on what was done to the scans when they were read.
    `input` says what a folder held, and what looks wrong with it; None where there is no folder.
    """

    name: str
    scans: tuple[Scan, ...]
    unit: str = "file"
    poses: Mapping[str, Array] | None = None
    objects: Mapping[str, str] | None = None
    motions: Mapping[str, Array] = field(default_factory=dict)
    sensors: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    initial: Mapping[str, Array] = field(default_factory=dict)
    sources: Mapping[str, tuple[Path, int]] = field(default_factory=dict)
    input: Input | None = None

    def __post_init__(self) -> None:
        if self.poses is not None:
            checks.keep(self, poses=checks.named_poses("ScanSet.poses", self.poses))
        if self.objects is not None:
            checks.instance("ScanSet.objects", self.objects, Mapping)
        checks.keep(self, motions=checks.named_poses("ScanSet.motions", self.motions))
        checks.keep(self, initial=checks.named_poses("ScanSet.initial", self.initial))
        checks.instance("ScanSet.sensors", self.sensors, Mapping)
        checks.instance("ScanSet.remarks", self.remarks, tuple)

    def sensor_of(self, scan: Scan) -> str:
        """Who told where the scan's sensor was: ``file``, ``user``, ``data set`` or ``unknown``."""
        if not scan.knows_sensor:
            return "unknown"
        return self.sensors.get(scan.name, "data set")

    def as_read(self, poses: Mapping[str, Array]) -> dict[str, Array]:
        """Poses ``T_any_scan`` (4, 4) as those of the same scans before they were moved."""
        return {
            name: pose @ self.motions[name] if name in self.motions else pose
            for name, pose in poses.items()
        }

    def truth_beside(self, scan: str) -> Mapping[str, Array] | None:
        """The true poses of the scans that show the same object as `scan`; None where unknown."""
        if self.poses is None or self.objects is None:
            return self.poses
        shown = self.objects.get(scan)
        return {name: T for name, T in self.poses.items() if self.objects.get(name) == shown}


def too_many_trees(scans: Iterable[Scan]) -> bool:
    """Whether to `forget` the tree of each scan of a set when what asks it has done so."""
    return sum(len(scan.points) for scan in scans) > HELD_IN_TREES
