"""Read known poses: ground truth, or the result of an earlier run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io.table import excerpt, is_number
from mvreg.types import Array

#: Largest entry of R^T R - I, and deviation of a quaternion's length from 1, that rounding in a
#: text file explains; beyond it the matrix is scaled or sheared, or no pose at all.
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
        file. The rotations are made exactly orthonormal.

    Raises
    ------
    InputError
        With file, line or name, and reason.
    """
    path = Path(path)
    readers = {".conf": _read_conf, ".json": _read_json}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: expected poses in a file ending in {' or '.join(readers)}")
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected text in UTF-8: {error}") from error
    poses = reader(text, path)
    if not poses:
        raise InputError(f"{path}: expected at least one pose, found none")
    return poses


def _read_conf(text: str, path: Path) -> dict[str, Array]:
    """``bmesh FILE tx ty tz qx qy qz qw``: x_world = R(q)^T x_scan + t.

    R(q) is the usual rotation matrix of the quaternion; its transpose is the only one of the
    conventions tried that brings the Stanford scans together. The lines ``camera`` and ``mesh``
    (the Cyberware turntable) are of no use here.
    """
    poses: dict[str, Array] = {}
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
        _add(poses, " ".join(words[1:-7]), se3.from_parts(rotation, numbers[:3]), where)
    return poses


def _read_json(text: str, path: Path) -> dict[str, Array]:
    try:
        content: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not a JSON file: {error}") from error
    if isinstance(content, dict) and isinstance(content.get("poses"), dict):
        content = content["poses"]
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected an object that maps scan names to 4x4 poses")
    poses: dict[str, Array] = {}
    for name, value in content.items():
        try:
            pose = np.array(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            pose = np.empty(0)
        if pose.shape not in {(4, 4), (16,)}:
            raise InputError(f"{path}, pose of {name!r}: expected 4x4 numbers, got {_show(value)}")
        _add(poses, name, pose.reshape(4, 4), f"{path}, pose of {name!r}")
    return poses


def _add(poses: dict[str, Array], name: str, pose: Array, where: str) -> None:
    """Check one pose, and file it under the bare file name."""
    if not np.isfinite(pose).all() or np.abs(pose[3] - [0, 0, 0, 1]).max() > 1e-9:
        raise InputError(f"{where}: expected finite numbers and the last row 0 0 0 1")
    rotation = np.clip(pose[:3, :3], -9, 9)  # so that nonsense cannot overflow
    error = np.abs(rotation.T @ rotation - np.eye(3)).max()
    if error > TOLERANCE or np.linalg.det(rotation) < 0:
        raise InputError(
            f"{where}: expected a rotation, got a matrix that scales, shears or mirrors "
            f"(R^T R - I up to {error:.2g}, determinant {np.linalg.det(rotation):.3g})"
        )
    name = name.replace("\\", "/").rsplit("/", 1)[-1]
    if name in poses:
        raise InputError(f"{where}: a second pose for {name!r}")
    poses[name] = se3.project(pose)


def _show(value: object) -> str:
    return excerpt(json.dumps(value))
