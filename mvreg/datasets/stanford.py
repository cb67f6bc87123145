"""The scans of the Stanford 3D Scanning Repository, under their original names."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mvreg.datasets.base import ScanSource
from mvreg.datasets.download import cache_folder, download
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io import read_points, read_poses
from mvreg.parallel import in_threads
from mvreg.types import Array, Scan, ScanSet

_UNITS = {1.0: "m", 100.0: "cm", 1000.0: "mm"}


@dataclass(frozen=True)
class Stanford(ScanSource):
    """Stanford scans and their ``.conf`` poses; choose a preset: bunny, dragon, buddha, armadillo.

    They are looked for in `root`, then in the folder that the environment variable MVREG_DATA
    names, then in the user's cache, and downloaded there if absent and there is a `url`. The
    sensor is at +z in the frame of every scan. The preset armadillo_virtual has virtual scans of
    the Armadillo's reconstruction, laid out in the same way.

    Parameters
    ----------
    name : str
        What the set is called.
    conf : str
        The file with the poses.
    files : list of str
        The scans wanted. They are handed over in the order of the ``.conf``.
    folders : list of str
        Where the files may be, below the places searched; those themselves are always tried.
    url : str
        The archive that holds them; empty if there is none.
    root : str
        A folder to search first.
    unit_per_metre : float
        What metres, the unit of the files, are converted to; 1000 for millimetres.
    """

    name: str = ""
    conf: str = ""
    files: list[str] = field(default_factory=list)
    folders: list[str] = field(default_factory=list)
    url: str = ""
    root: str = ""
    unit_per_metre: float = 1000.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (np.isfinite(self.unit_per_metre) and self.unit_per_metre > 0):
            raise InputError(
                f"dataset.unit_per_metre={self.unit_per_metre}: expected a positive number"
            )

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Read the scans.

        Raises
        ------
        InputError
            If they are neither here nor to be downloaded, or if some are missing or damaged.
        """
        if not (self.name and self.conf and self.files):
            raise InputError(
                "dataset=stanford is what presets build on: use dataset=bunny, dragon, buddha or "
                "armadillo, or set name, conf, files and url"
            )
        folder = self._find() or self._download()
        poses = {
            name: self._scaled(pose)
            for name, pose in read_poses(folder / self.conf).items()
            if name in self.files
        }
        names = [*poses, *(name for name in self.files if name not in poses)]
        scans = tuple(in_threads(lambda name: self._scan(folder, name), names))
        unit = _UNITS.get(self.unit_per_metre, f"m/{self.unit_per_metre:g}")
        return ScanSet(self.name, scans, unit, poses or None)

    def _scan(self, folder: Path, name: str) -> Scan:
        points = self.unit_per_metre * read_points(folder / name)
        return Scan(name, points, view_direction=np.array([0.0, 0.0, 1.0]))

    def _scaled(self, pose: Array) -> Array:
        return se3.from_parts(pose[:3, :3], self.unit_per_metre * pose[:3, 3])

    def _roots(self) -> list[Path]:
        given = [self.root, os.environ.get("MVREG_DATA", "")]
        return [*(Path(g).expanduser() for g in given if g), cache_folder() / self.name]

    def _places(self) -> Iterator[Path]:
        for root in self._roots():
            yield from (root / folder for folder in self.folders)
            yield root

    def _missing(self, folder: Path) -> list[str]:
        return [name for name in [self.conf, *self.files] if not (folder / name).is_file()]

    def _find(self) -> Path | None:
        """The first folder that has everything; None where nothing is anywhere."""
        partial: dict[Path, list[str]] = {}
        for place in self._places():
            missing = self._missing(place)
            if not missing:
                return place
            if len(missing) <= len(self.files):
                partial[place] = missing
        if partial:
            lacks = [f"  {place} lacks {', '.join(names)}" for place, names in partial.items()]
            source = f" from {self.url}" if self.url else ""
            raise InputError(
                "\n".join([
                    f"dataset={self.name} is incomplete:", *lacks,
                    f"Complete it{source}, or point dataset.root or MVREG_DATA elsewhere.",
                ])
            )  # fmt: skip
        return None

    def _download(self) -> Path:
        target = cache_folder() / self.name
        if not self.url:
            raise InputError(
                f"dataset={self.name} is not on this machine, and there is no address to download "
                f"it from\n{self._wanted()}\n"
                "Set dataset.root or MVREG_DATA to the folder that has it, or go on with "
                "dataset=figurine, which needs no files."
            )
        try:
            download(self.url, [self.conf, *self.files], target)
        except InputError as error:
            raise InputError(
                f"dataset={self.name} is not on this machine, and downloading it failed: {error}\n"
                f"{self._wanted()}\n"
                f"  address: {self.url}\n"
                "Unpack the archive yourself and set dataset.root or MVREG_DATA to its folder, or "
                "go on with dataset=figurine, which needs no download."
            ) from error
        return target

    def _wanted(self) -> str:
        """Where it was looked for, and what."""
        searched = ", ".join(str(root) for root in self._roots())
        return (
            f"  searched: {searched} (and in them {', '.join(self.folders)})\n"
            f"  wanted: {', '.join([self.conf, *self.files])}"
        )
