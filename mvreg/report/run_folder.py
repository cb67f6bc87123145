"""The files of a run folder, each written whole or not at all."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePath

import numpy as np

from mvreg.report.model import model_clouds, model_kinds
from mvreg.types import Array, Result, ScanSet

#: Bytes of a scan's name in a file name, of the 255 that file systems allow.
LONGEST = 200


def write_text(path: Path, text: str) -> None:
    """Write a text atomically: a reader sees the old file or the new one, never a part."""
    write_part(path, text)
    take_place(path)


def write_part(path: Path, text: str) -> None:
    """Write a text beside a file; `take_place` makes it the file. Nothing is left if it fails."""
    part = path.with_name(f"{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8")
    except OSError:
        part.unlink(missing_ok=True)
        raise


def take_place(path: Path) -> None:
    """Give what `write_part` has written the name of the file."""
    path.with_name(f"{path.name}.part").replace(path)


def pose_files(names: Iterable[str]) -> dict[str, str]:
    """A file name for each scan: its stem, safe on every file system, and unique."""
    files: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        base = PurePath(name.replace("\\", "/")).name
        # An ending such as ".ply" goes; the ".2" of "scan.2" is part of the name.
        base = re.sub(r"\.[A-Za-z][A-Za-z0-9]*$", "", base)
        base = _shortened(re.sub(r"[^\w.+-]", "_", base)).strip(".") or "scan"
        stem, count = base, 1
        while _folded(stem) in taken:
            count += 1
            stem = f"{base}-{count}"
        taken.add(_folded(stem))
        files[name] = f"{stem}.txt"
    return files


def _shortened(base: str) -> str:
    """As much of a name as a file system takes with a number and an ending after it."""
    return base.encode()[:LONGEST].decode(errors="ignore")


def _folded(stem: str) -> str:
    """What two names have in common where a file system takes them for the same."""
    return unicodedata.normalize("NFKD", unicodedata.normalize("NFKD", stem).casefold())


def write_placements(folder: Path, scanset: ScanSet, result: Result) -> None:
    """The poses of the reference's partial model, and those of every other.

    ``poses`` is the reference's; ``poses/component_2``, and so on, are the others', each in a frame
    of its own. What an earlier run left of such goes.
    """
    for left in (folder / "poses").glob("component_*"):
        if left.is_dir():
            write_poses(left, scanset, {})
            if not any(left.iterdir()):
                left.rmdir()
    write_poses(folder / "poses", scanset, result.poses)
    for number, poses in enumerate(result.components, start=2):
        write_poses(folder / "poses" / f"component_{number}", scanset, poses)


def write_models(folder: Path, scanset: ScanSet, result: Result) -> None:
    """The models: ``model.ply`` is the reference's, ``model_2.ply``, and so on, are the others'."""
    for model in folder.glob("model_*.ply"):
        if re.fullmatch(r"model_\d+\.ply", model.name):
            model.unlink()
    write_model(folder / "model.ply", scanset, result.poses)
    for number, poses in enumerate(result.components, start=2):
        write_model(folder / f"model_{number}.ply", scanset, poses)


def write_poses(folder: Path, scanset: ScanSet, poses: Mapping[str, Array]) -> None:
    """A 4x4 text file per placed scan, exact to the last bit; none for a scan without a pose."""
    folder.mkdir(exist_ok=True)
    for name, file in pose_files(scan.name for scan in scanset.scans).items():
        if name in poses:
            np.savetxt(folder / file, poses[name], fmt="%.17g")
        else:
            (folder / file).unlink(missing_ok=True)


def write_model(path: Path, scanset: ScanSet, poses: Mapping[str, Array]) -> None:
    """All points of the placed scans in their model's frame, with their attributes."""
    from mvreg.io import write_ply_clouds

    write_ply_clouds(path, model_clouds(scanset, poses), model_kinds(scanset, poses))


def link_latest(folder: Path) -> None:
    """Let ``latest`` beside `folder` point to it; where links are not allowed, a text file."""
    folder = folder.resolve()
    link = folder.parent / "latest"
    if link.exists() and not link.is_symlink():
        return  # somebody else's; leave it alone
    temporary = folder.parent / f".latest-{os.getpid()}"
    try:
        temporary.unlink(missing_ok=True)
        temporary.symlink_to(folder.name, target_is_directory=True)
        temporary.replace(link)
    except OSError:
        (folder.parent / "latest.txt").write_text(f"{folder.name}\n", encoding="utf-8")


def overrides_of(folder: Path) -> list[str]:
    """What was said on the command line of a run, as Hydra keeps it; nothing where it does not."""
    from omegaconf import ListConfig, OmegaConf

    file = folder / ".hydra" / "overrides.yaml"
    if not file.is_file():
        return []
    found = OmegaConf.load(file)
    return [str(word) for word in found] if isinstance(found, ListConfig) else []
