"""Read known poses: ground truth, or the result of an earlier run."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError, few
from mvreg.geometry import se3
from mvreg.io.rigid import FINE, nearest_rigid
from mvreg.io.table import excerpt, is_number
from mvreg.io.utf8 import read_utf8
from mvreg.types import Array

#: Deviation of a quaternion's length from 1 that rounding in a text file explains.
TOLERANCE = 1e-2


def read_poses(path: str | Path) -> dict[str, Array]:
    """Read the poses of scans.

    Parameters
    ----------
    path : str or Path
        ``.conf``: the Stanford repository's, of whose lines only ``bmesh`` counts.
        ``.json``: ``{name: pose}``, or the ``result.json`` of a run, whose ``poses`` are taken;
        a pose is 4 rows of 4 numbers or 16 numbers, row by row.

    Returns
    -------
    dict of str to (4, 4) array
        ``T_world_scan`` by the scan's file name, in the order and in the unit of length of the
        file. The rotations are made exactly orthonormal: entries of two decimals are enough.

    Raises
    ------
    InputError
        With file, line or name, and reason.
    """
    return read_poses_and_remarks(path)[0]


def read_poses_and_remarks(path: str | Path) -> tuple[dict[str, Array], tuple[str, ...]]:
    """As `read_poses`, and what is said of rotations that were printed with few digits."""
    path = Path(path)
    readers = {".conf": _read_conf, ".json": _read_json}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: expected poses in a file ending in {' or '.join(readers)}")
    found = Found()
    reader(read_utf8(path), path, found)
    if not found.poses:
        raise InputError(f"{path}: expected at least one pose, found none")
    return found.poses, found.remarks(path)


@dataclass
class Found:
    """The poses of a file by the bare file name, and how far each was from a rotation."""

    poses: dict[str, Array] = field(default_factory=dict)
    deviations: dict[str, float] = field(default_factory=dict)

    def add(self, name: str, pose: Array, where: str) -> None:
        """Check one pose, and file it."""
        if not np.isfinite(pose).all() or np.abs(pose[3] - [0, 0, 0, 1]).max() > 1e-9:
            raise InputError(f"{where}: expected finite numbers and the last row 0 0 0 1")
        try:
            rigid, deviation = nearest_rigid(pose)
        except ValueError as error:
            raise InputError(f"{where}: {error}") from None
        name = name.replace("\\", "/").rsplit("/", 1)[-1]
        if name in self.poses:
            raise InputError(f"{where}: a second pose for {name!r}")
        self.poses[name], self.deviations[name] = rigid, deviation

    def remarks(self, path: Path) -> tuple[str, ...]:
        """What is said of the poses with few digits: one sentence, or nothing."""
        rounded = [name for name, deviation in self.deviations.items() if deviation > FINE]
        if not rounded:
            return ()
        return (
            f"{path.name}: the matrices of {len(rounded)} of {len(self.poses)} poses "
            f"({few(rounded)}) are no exact rotations, as of few decimals: the nearest rotations "
            f"are taken, which differ by up to {max(self.deviations.values()):.2g} in an entry",
        )


def _read_conf(text: str, path: Path, found: Found) -> None:
    """``bmesh FILE tx ty tz qx qy qz qw``: x_world = R(q)^T x_scan + t.

    R(q) is the usual rotation matrix of the quaternion; its transpose is the only one of the
    conventions tried that brings the Stanford scans together. The lines ``camera`` and ``mesh``
    (the Cyberware turntable) are of no use here.
    """
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words or words[0] != "bmesh":
            continue
        where = f"{path}, line {number}"
        if len(words) < 9 or not all(map(is_number, words[-7:])):
            raise InputError(
                f"{where}: expected 'bmesh FILE tx ty tz qx qy qz qw', got {excerpt(line)}"
            )
        numbers = np.array([float(word) for word in words[-7:]])
        length = float(np.linalg.norm(numbers[3:]))
        if not abs(length - 1) <= TOLERANCE:
            raise InputError(f"{where}: expected a quaternion of length 1, got length {length:g}")
        rotation = se3.rotation_from_quaternion(numbers[3:]).T
        found.add(" ".join(words[1:-7]), se3.from_parts(rotation, numbers[:3]), where)


def _read_json(text: str, path: Path, found: Found) -> None:
    try:
        content: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not a JSON file: {error}") from error
    if isinstance(content, dict) and isinstance(content.get("poses"), dict):
        content = content["poses"]
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected an object that maps scan names to 4x4 poses")
    for name, value in content.items():
        try:
            pose = np.array(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            pose = np.empty(0)
        if pose.shape not in {(4, 4), (16,)}:
            raise InputError(f"{path}, pose of {name!r}: expected 4x4 numbers, got {_show(value)}")
        found.add(name, pose.reshape(4, 4), f"{path}, pose of {name!r}")


def _show(value: object) -> str:
    return excerpt(json.dumps(value))
