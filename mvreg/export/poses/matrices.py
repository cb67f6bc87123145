"""Poses as 4x4 matrices in text: alone, together, for CloudCompare, for MeshLab."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.export.placements import Component, Placements
from mvreg.export.poses.text import one_line, rows, stems
from mvreg.report.run_folder import write_text
from mvreg.types import Array

#: Bytes of a line of an .aln, with its end, that MeshLab reads.
LONGEST_LINE = 1023


def write_matrix(folder: Path, component: Component, placements: Placements) -> list[str]:
    """``matrix/NAME.txt``: four rows of four numbers per scan, ``T_model_scan``."""
    return _one_each(folder / "matrix", component, placements)


def write_cloudcompare(folder: Path, component: Component, placements: Placements) -> list[str]:
    """``cloudcompare/NAME.txt``: as CloudCompare loads a matrix, and ``-APPLY_TRANS`` does."""
    return _one_each(folder / "cloudcompare", component, placements)


def _one_each(folder: Path, component: Component, placements: Placements) -> list[str]:
    folder.mkdir(parents=True, exist_ok=True)
    names = stems(placements)
    for name, pose in component.poses.items():
        write_text(folder / f"{names[name]}.txt", rows(pose))
    return []


def write_matrices(folder: Path, component: Component, placements: Placements) -> list[str]:
    """``matrices.txt``: for each scan a line ``# NAME`` and its four rows."""
    blocks = [f"# {one_line(name)}\n{rows(pose)}" for name, pose in component.poses.items()]
    write_text(folder / "matrices.txt", "\n".join(blocks))
    return []


def read_matrices(folder: Path) -> dict[str, Array]:
    """The poses of a ``matrices.txt``, by scan.

    Raises
    ------
    InputError
        If it is not as `write_matrices` writes it.
    """
    path = folder / "matrices.txt"
    found: dict[str, Array] = {}
    for block in path.read_text(encoding="utf-8").split("\n\n"):
        head, *lines = block.strip("\n").split("\n")
        try:
            pose = np.array([line.split() for line in lines], dtype=np.float64)
        except ValueError:
            pose = np.empty(0)
        if not head.startswith("# ") or pose.shape != (4, 4):
            raise InputError(
                f"{path}: expected blocks of '# NAME' and four rows of four numbers, with empty "
                f"lines between; got {block[:80]!r}"
            )
        found[head[2:]] = pose
    return found


def write_meshlab(folder: Path, component: Component, placements: Placements) -> list[str]:
    """``meshlab.aln``: a count, and for each scan its file, ``#`` and four rows; ``0`` ends it."""
    parts = [f"{len(component.poses)}\n"]
    for name, pose in component.poses.items():
        file = one_line(name)
        if len(file.encode()) >= LONGEST_LINE:
            raise InputError(f"{name!r}: MeshLab reads names of {LONGEST_LINE} bytes at most")
        parts.append(f"{file}\n#\n{rows(pose)}")
    write_text(folder / "meshlab.aln", "".join([*parts, "0\n"]))
    return ["meshlab.aln names the scans' files without a folder: lay it beside them"]
