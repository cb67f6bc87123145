"""A format out: ``mvreg export RUN nameless`` writes the poses as a table."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.export import Component, Placements, PoseFormat
from mvreg.geometry import Array, se3

#: The columns: the scan, where it is (file units), and how it is turned.
COLUMNS = ("scan", "x", "y", "z", "qx", "qy", "qz", "qw")


def write_nameless(folder: Path, component: Component, placements: Placements) -> list[str]:
    """Write ``nameless.csv``: a row per scan of a component.

    Parameters
    ----------
    folder : Path
        Where to; it is there.
    component : Component
        Its `poses` map names of scans to ``T_model_scan`` (4, 4): ``x_model = T @ x_scan``, from
        the frame that the scan has in its file.
    placements : Placements
        Of the whole run: all names in the order of the data set, and those without a pose.

    Returns
    -------
    list of str
        What a user should know, such as what the format has no place for.
    """
    with (folder / "nameless.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(COLUMNS)
        for name, T_model_scan in component.poses.items():
            turn = se3.quaternion(T_model_scan[:3, :3])  # x, y, z, w
            table.writerow([name, *map(repr, [*T_model_scan[:3, 3].tolist(), *turn.tolist()])])
    return []


def read_nameless(folder: Path) -> dict[str, Array]:
    """Read the poses of a ``nameless.csv``, by scan.

    Raises
    ------
    InputError
        If it is not as `write_nameless` writes it.
    """
    path = folder / "nameless.csv"
    with path.open(encoding="utf-8", newline="") as file:
        head, *rows = list(csv.reader(file)) or [[]]
    if tuple(head) != COLUMNS:
        raise InputError(f"{path}:1: expected {','.join(COLUMNS)}, got {','.join(head)!r}")
    found = {}
    for number, (name, *words) in enumerate(rows, start=2):
        try:
            x, y, z, qx, qy, qz, qw = map(float, words)
        except ValueError:
            raise InputError(f"{path}:{number}: expected seven numbers, got {words}") from None
        turn = se3.rotation_from_quaternion(np.array([qx, qy, qz, qw]))
        found[name] = se3.from_parts(turn, np.array([x, y, z]))
    return found


#: The format as mvreg registers it; ``read`` may be left out, the tests use it.
#: For points as well, see `mvreg.export.PointFormat`.
NAMELESS = PoseFormat(
    "nameless", "nameless.csv", "poses as a table: position and quaternion", write_nameless,
    read_nameless,
)  # fmt: skip
