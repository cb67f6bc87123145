"""What an E57 file says of its scans before their points."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io.e57_pages import PAGE
from mvreg.types import Array
from mvreg.types.attributes import COLOURS

XYZ = ("cartesianX", "cartesianY", "cartesianZ")
SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
GRID = ("rowIndex", "columnIndex")
#: The names of E57, and those of `PointCloud`.
NAMES = {"colorRed": "red", "colorGreen": "green", "colorBlue": "blue", "nor:normalX": "nx",
         "nor:normalY": "ny", "nor:normalZ": "nz"}  # fmt: skip


@dataclass(frozen=True, eq=False)
class ScanHeader:
    """One scan of a file.

    Parameters
    ----------
    index : int
        In the file.
    name : str
    count : int
        Points, with those of an invalid state.
    fields : tuple of str
        That are read: the three axes first.
    state : str
        The field that says which points are valid.
    pose : (4, 4) array, optional
        ``T_world_scan``.
    remarks : tuple of str
    colour_limits : mapping of str to (float, float)
        By colour, as `PointCloud` has it.
    """

    index: int
    name: str
    count: int
    fields: tuple[str, ...]
    state: str
    pose: Array | None
    remarks: tuple[str, ...]
    colour_limits: dict[str, tuple[float, float]]

    @property
    def axes(self) -> tuple[str, ...]:
        """The fields of the coordinates."""
        return self.fields[:3]

    @property
    def view_point(self) -> Array | None:
        """The sensor is at the origin if the file has the points as a scanner saw them."""
        posed = self.pose is not None and not np.array_equal(self.pose, np.eye(4))
        gridded = set(GRID) <= set(self.fields)
        return np.zeros(3) if self.axes == SPHERICAL or gridded or posed else None


def check_size(path: Path) -> None:
    """Hold what the header of the file says against how long it is.

    Raises
    ------
    InputError
        With file, byte and reason.
    """
    with path.open("rb") as stream:
        head = stream.read(48)
        size = stream.seek(0, 2)
    if head[:8] != b"ASTM-E57":
        raise InputError(f"{path}, byte 0: expected 'ASTM-E57', got {head[:8]!r}")
    if len(head) < 48:
        raise InputError(f"{path}, byte {size}: the file ends within its header; truncated")
    length, xml, xml_length, page = struct.unpack_from("<4Q", head, 16)
    if length != size or xml + xml_length > size or page != PAGE:
        raise InputError(
            f"{path}, byte 16: the header tells of {length} bytes in pages of {page}, found "
            f"{size}; the file is truncated or damaged"
        )


def scan_header(libe57: Any, node: Any, index: int, path: Path) -> ScanHeader:
    """Read what is said of a scan.

    Raises
    ------
    InputError
        If it has no coordinates.
    """
    name = str(node["name"].value()) if node.isDefined("name") else f"scan{index + 1}"
    prototype = libe57.StructureNode(node["points"].prototype())
    fields = [prototype.get(i).elementName() for i in range(prototype.childCount())]
    axes = XYZ if set(XYZ) <= set(fields) else SPHERICAL
    if not set(axes) <= set(fields):
        raise InputError(
            f"{path}, scan {name!r}: expected Cartesian or spherical points, found {fields}"
        )
    state = "cartesianInvalidState" if axes == XYZ else "sphericalInvalidState"
    more = (*NAMES, "intensity", *GRID, state, "timeStamp")
    pose, remarks = _pose(node)
    limits = {
        NAMES[field]: _colour_limits(field, node, prototype)
        for field in fields if NAMES.get(field) in COLOURS
    }  # fmt: skip
    return ScanHeader(
        index, name, int(node["points"].childCount()),
        (*axes, *(field for field in more if field in fields)), state, pose, remarks, limits,
    )  # fmt: skip


def _colour_limits(field: str, node: Any, prototype: Any) -> tuple[float, float]:
    """How far a colour goes: as the scan says, or its type."""
    if node.isDefined("colorLimits") and node["colorLimits"].isDefined(f"{field}Maximum"):
        limits = node["colorLimits"]
        return float(limits[f"{field}Minimum"].value()), float(limits[f"{field}Maximum"].value())
    return 0.0, float(prototype[field].maximum())


def _pose(node: Any) -> tuple[Array | None, tuple[str, ...]]:
    if not node.isDefined("pose"):
        return None, ()
    pose = node["pose"]
    turn, shift = np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3)
    if pose.isDefined("rotation"):
        turn = np.array([float(pose["rotation"][part].value()) for part in "xyzw"])
    if pose.isDefined("translation"):
        shift = np.array([float(pose["translation"][part].value()) for part in "xyz"])
    if not (np.isfinite(shift).all() and 1e-6 < np.linalg.norm(turn) < 1e6):
        return None, ("its pose is no rigid motion and was left out",)
    return se3.from_parts(se3.rotation_from_quaternion(turn), shift), ()
