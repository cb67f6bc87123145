"""The E57 files that came, with the poses of the run in them."""

from __future__ import annotations

from pathlib import Path

from mvreg.errors import InputError, few
from mvreg.export.model import Model
from mvreg.io.e57_poses import positions, rewrite_poses
from mvreg.types import Array


def write_e57_poses(folder: Path, model: Model) -> list[str]:
    """``e57_poses/``: a copy of each E57 file of the run, only its poses changed.

    Scans without a pose keep that of their file, which a remark says.

    Raises
    ------
    InputError
        If no scan is from an E57 file, or a file is not what it was.
    """
    by_file: dict[Path, dict[int, str]] = {}
    for name, (path, index) in model.scanset.sources.items():
        if path.suffix.lower() == ".e57":
            by_file.setdefault(path, {})[index] = name
    if not by_file:
        raise InputError(
            "export=e57_poses: expected scans from E57 files, found none; for others use e57"
        )
    remarks = []
    below = folder / "e57_poses"
    below.mkdir(exist_ok=True)
    for path, names in by_file.items():
        places = positions(path)
        if len(places) != len(names):
            raise InputError(
                f"{path}: expected {len(names)} scans with points, as they were registered, found "
                f"{len(places)}"
            )
        poses: dict[int, Array] = {
            places[index]: model.component.poses[name]
            for index, name in names.items()
            if name in model.component.poses
        }
        without = [name for name in names.values() if name not in model.component.poses]
        if without:
            remarks.append(f"{path.name} keeps the poses that it had of {few(without)}")
        if poses:
            rewrite_poses(path, below / path.name, poses)
    return remarks
