"""Poses as trajectories: TUM, KITTI, Redwood."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.export.placements import Component, Placements
from mvreg.export.poses.text import rows, words, write_names
from mvreg.geometry import se3
from mvreg.report.run_folder import write_text
from mvreg.types import Array


def write_tum(folder: Path, component: Component, placements: Placements) -> list[str]:
    """``tum.txt``: ``timestamp tx ty tz qx qy qz qw``; for a time the scan's number in the set."""
    lines = [
        f"{placements.number(name)} {words(pose[:3, 3])} {words(se3.quaternion(pose[:3, :3]))}\n"
        for name, pose in component.poses.items()
    ]
    write_text(folder / "tum.txt", "".join(lines))
    write_names(folder / "tum_names.txt", component, placements)
    return []


def read_tum(folder: Path) -> dict[str, Array]:
    """The poses of a ``tum.txt``, named by the ``tum_names.txt`` beside it.

    Raises
    ------
    InputError
        If a line has not eight numbers, or there are not as many names.
    """
    path = folder / "tum.txt"
    lines = path.read_text(encoding="utf-8").splitlines()
    names = [
        line.split("\t", 2)[-1]
        for line in (folder / "tum_names.txt").read_text(encoding="utf-8").splitlines()
    ]
    try:
        table = np.array([line.split() for line in lines], dtype=np.float64)
    except ValueError:
        table = np.empty(0)
    if table.shape != (len(names), 8):
        raise InputError(f"{path}: expected {len(names)} lines of eight numbers, as names beside")
    return {
        name: se3.from_parts(se3.rotation_from_quaternion(row[4:]), row[1:4])
        for name, row in zip(names, table, strict=True)
    }


def write_kitti(folder: Path, component: Component, placements: Placements) -> list[str]:
    """``kitti.txt``: the first three rows of each pose in a line, row by row."""
    lines = [f"{words(pose[:3].ravel())}\n" for pose in component.poses.values()]
    write_text(folder / "kitti.txt", "".join(lines))
    write_names(folder / "kitti_names.txt", component, placements)
    return []


def write_redwood(folder: Path, component: Component, placements: Placements) -> list[str]:
    """``redwood.log``: for each pose a line of three numbers, and four rows."""
    blocks = [
        f"{index} {index} {index + 1}\n{rows(pose)}"
        for index, pose in enumerate(component.poses.values())
    ]
    write_text(folder / "redwood.log", "".join(blocks))
    write_names(folder / "redwood_names.txt", component, placements)
    return []
