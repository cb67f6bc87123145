"""Any folder of scans."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mvreg.datasets.base import ScanSource
from mvreg.datasets.folder_files import Listing, find_files, natural
from mvreg.datasets.folder_remarks import remark_on_left_out, remarks_of
from mvreg.datasets.folder_scans import Reader, ReadFiles, read_all
from mvreg.datasets.inspection import inspect_scans
from mvreg.datasets.large import MOST_POINTS
from mvreg.datasets.no_returns import remark_on_zeros
from mvreg.errors import InputError, few
from mvreg.io import ReadOptions
from mvreg.io.poses import read_poses_and_remarks
from mvreg.io.text import check_columns
from mvreg.plugins import manager
from mvreg.types import Array, Input, ScanSet


@dataclass(frozen=True)
class Folder(ScanSource):
    """Every readable file in a folder, sorted as people count: scan2 before scan10.

    Of a file with several scans each is one, ``FILE:NAME`` or ``FILE:2``. Files beside the scans
    that hold none are left out with a remark: notes, poses, and what has a handful of points.

    Where the sensor stood is known where `sensor` or the file says it. PCD does by VIEWPOINT: its
    translation is the sensor's position in the coordinates of the points. The default,
    ``0 0 0 1 0 0 0``, says nothing, because most writers write it regardless; if the sensor is at
    the origin, say ``sensor=origin``. Some writers mean by VIEWPOINT how the points are still to be
    moved: then say ``origin`` or ``unknown``.

    Points at exactly 0, 0, 0 of which a scan has several are dropped with a remark: some sensors
    write them where nothing came back.

    Parameters
    ----------
    path : str
        The folder; required.
    path_in : str
        For presets: the environment variable that names the folder in which a relative `path` is;
        empty for the current folder.
    ground_truth : str
        A Stanford ``.conf``, a JSON of poses or a run's ``result.json``, in the unit of the
        files; a relative name is looked for here and then in the folder. Optional.
    pattern : str
        Which files to take, ``"*.ply"`` for instance.
    unit : str
        The unit of length, for people to read; nothing is converted.
    recursive : bool
        Look into folders within the folder, too.
    columns : list of str
        Of tables of text: the names of all columns in order, ``_`` for those not wanted, instead
        of those that the header has: ``[_,_,x,y,z,intensity]``.
    most_points : int
        Of a scan with more points than so many, so many are registered, drawn at random; 0 for no
        limit. The model has all points, whatever it is.
    """

    path: str = ""
    ground_truth: str = ""
    pattern: str = "*"
    unit: str = "file"
    path_in: str = ""
    most_points: int = MOST_POINTS
    recursive: bool = False
    columns: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.pattern or "/" in self.pattern:
            raise InputError(
                f"dataset.pattern={self.pattern!r}: expected a pattern of file names, like '*.ply'"
            )
        if self.most_points < 0:
            raise InputError(f"dataset.most_points={self.most_points}: expected 0 or more")
        check_columns(self.columns)
        if not self.unit:
            raise InputError("dataset.unit: expected a unit of length or 'file', got nothing")

    @property
    def name(self) -> str:
        """The folder's name."""
        return home(self.path).resolve().name or "folder" if self.path else "folder"

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Read the folder.

        Raises
        ------
        InputError
            If it has fewer than two scans; if any file cannot be read, with all such files; if
            the ground truth fits none of the scans.
        """
        if not self.path:
            raise InputError("dataset=folder needs the folder with your scans: dataset.path=DIR")
        folder, formats = self._folder(), manager.formats()
        listing = find_files(folder, self.pattern, self.recursive, formats)
        reader = Reader(folder, ReadOptions(tuple(self.columns)), formats, self.most_points)
        read = read_all(listing.files, reader)
        scans = tuple(each.scan for each in read.scans)
        if len(scans) < 2:
            raise InputError(self._toofew(folder, list(formats), listing, read))
        poses, rounded = self._poses(folder, [scan.name for scan in scans])
        return ScanSet(
            self.name, scans, self.unit, poses,
            sensors={scan.name: "file" for scan in scans if scan.knows_sensor},
            remarks=(
                *remark_on_zeros({each.scan.name: each.dropped for each in read.scans}),
                *remarks_of(read.scans), *remark_on_left_out(read.left_out), *listing.remarks,
                *rounded,
            ),
            sources={each.scan.name: each.source for each in read.scans},
            initial={each.scan.name: each.initial for each in read.scans
                     if each.initial is not None},
            input=Input(
                len(listing.files) - len(read.left_out),
                {**read.left_out, **listing.left_out},
                inspect_scans(scans),
            ),
        )  # fmt: skip

    def _folder(self) -> Path:
        path = home(self.path)
        if path.is_absolute() or not self.path_in:
            return path
        above = os.environ.get(self.path_in, "")
        if above and (home(above) / path).is_dir():
            return home(above) / path
        state = f"is {above!r} and has none" if above else "is not set"
        raise InputError(
            f"dataset={self.name} is not on this machine: its scans are in {self.path} in the "
            f"folder that the environment variable {self.path_in} names, which {state}. Set "
            f"{self.path_in}, or set dataset.path to the full name of the folder with the scans, "
            "or go on with dataset=figurine, which needs no files."
        )

    def _toofew(self, folder: Path, suffixes: list[str], listing: Listing, read: ReadFiles) -> str:
        there = [*listing.files, *listing.others, *listing.unmatched]
        there = sorted([*there, *(f"{name}/" for name in listing.folders)], key=natural)
        deeper = "; dataset.recursive=true looks into folders" if listing.folders else ""
        return (
            f"dataset.path={folder}: expected at least 2 scans that match {self.pattern!r} and end "
            f"in {', '.join(suffixes)}; found {few([each.scan.name for each in read.scans])} among "
            f"{few(there)}{''.join(f'; {each}' for each in remark_on_left_out(read.left_out))}"
            f"{deeper}"
        )

    def _poses(
        self, folder: Path, names: list[str]
    ) -> tuple[dict[str, Array] | None, tuple[str, ...]]:
        """The ground truth, None where there is none, and what is to be said of it."""
        if not self.ground_truth:
            return None, ()
        file = home(self.ground_truth)
        if not file.exists() and (folder / file).exists():
            file = folder / file
        known, remarks = read_poses_and_remarks(file)
        poses = {name: known[name] for name in names if name in known}
        if not poses:
            raise InputError(
                f"dataset.ground_truth={file}: expected poses of the scans in {folder}, "
                f"{few(names)}; got poses of {few(list(known))}"
            )
        return poses, remarks


def home(path: str) -> Path:
    """A path in which ``~`` or ``~user`` at the beginning is a home folder, if there is one."""
    given = Path(path)
    try:
        return given if given.exists() else given.expanduser()
    except RuntimeError:  # there is no such user
        return given
