"""Any folder of scans."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from mvreg.datasets.base import ScanSource
from mvreg.datasets.large import MOST_POINTS, held
from mvreg.datasets.no_returns import remark_on_zeros, without_zeros
from mvreg.errors import InputError
from mvreg.io import SUPPORTED, PointCloud, read_cloud, read_poses
from mvreg.parallel import in_threads
from mvreg.types import Array, Scan, ScanSet


@dataclass(frozen=True)
class Folder(ScanSource):
    """Every readable file in a folder, sorted as people count: scan2 before scan10.

    Where the sensor stood is known where `sensor` or the file says it. Of the formats only PCD
    can, by VIEWPOINT: its translation is the sensor's position in the coordinates of the points.
    The default, ``0 0 0 1 0 0 0``, says nothing, because most writers write it regardless; if the
    sensor is at the origin, say ``sensor=origin``. Some writers mean by VIEWPOINT how the points
    are still to be moved: then say ``origin`` or ``unknown``.

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

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.pattern or "/" in self.pattern:
            raise InputError(
                f"dataset.pattern={self.pattern!r}: expected a pattern of file names, like '*.ply'"
            )
        if self.most_points < 0:
            raise InputError(f"dataset.most_points={self.most_points}: expected 0 or more")
        if not self.unit:
            raise InputError("dataset.unit: expected a unit of length or 'file', got nothing")

    @property
    def name(self) -> str:
        """The folder's name."""
        return Path(self.path).expanduser().resolve().name or "folder" if self.path else "folder"

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
        folder = self._folder()
        files = self._files(folder)
        read = _read_all(files, self.most_points)
        scans = tuple(each.scan for each in read)
        poses = self._poses(folder, [scan.name for scan in scans]) if self.ground_truth else None
        return ScanSet(
            self.name, scans, self.unit, poses,
            sensors={scan.name: "file" for scan in scans if scan.knows_sensor},
            remarks=remark_on_zeros({each.scan.name: each.dropped for each in read}),
        )  # fmt: skip

    def _folder(self) -> Path:
        path = Path(self.path).expanduser()
        if path.is_absolute() or not self.path_in:
            return path
        above = os.environ.get(self.path_in, "")
        if above and (Path(above).expanduser() / path).is_dir():
            return Path(above).expanduser() / path
        state = f"is {above!r} and has none" if above else "is not set"
        raise InputError(
            f"dataset={self.name} is not on this machine: its scans are in {self.path} in the "
            f"folder that the environment variable {self.path_in} names, which {state}. Set "
            f"{self.path_in}, or set dataset.path to the full name of the folder with the scans, "
            "or go on with dataset=figurine, which needs no files."
        )

    def _files(self, folder: Path) -> list[Path]:
        try:
            found = sorted(folder.iterdir(), key=lambda file: natural(file.name))
        except OSError as error:
            raise InputError(
                f"dataset.path={folder}: expected a folder: {error.strerror or error}"
            ) from error
        files = [
            file for file in found
            if fnmatchcase(file.name, self.pattern) and not file.name.startswith(".")
            and file.suffix.lower() in SUPPORTED and file.is_file()
        ]  # fmt: skip
        if len(files) < 2:
            raise InputError(
                f"dataset.path={folder}: expected at least 2 scans that match {self.pattern!r} "
                f"and end in {', '.join(SUPPORTED)}; found {_few([f.name for f in files])} "
                f"among {_few([file.name for file in found])}"
            )
        return files

    def _poses(self, folder: Path, names: list[str]) -> dict[str, Array]:
        file = Path(self.ground_truth).expanduser()
        if not file.exists() and (folder / file).exists():
            file = folder / file
        known = read_poses(file)
        poses = {name: known[name] for name in names if name in known}
        if not poses:
            raise InputError(
                f"dataset.ground_truth={file}: expected poses of the scans in {folder}, "
                f"{_few(names)}; got poses of {_few(list(known))}"
            )
        return poses


def natural(name: str) -> tuple[list[tuple[int, str]], str]:
    """A key that sorts names as people count; the name itself settles ties."""
    parts = re.findall(r"[0-9]+|[^0-9]+", name.casefold())
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts], name


@dataclass(frozen=True)
class _Read:
    """A scan as read, and how many of its points were `dropped`."""

    scan: Scan
    dropped: int


def _read_all(files: list[Path], most: int) -> list[_Read]:
    """Read every file, and report all that cannot be read at once."""
    found = in_threads(lambda file: _read(file, most), files)
    errors = [f"  {each}" for each in found if isinstance(each, InputError)]
    if errors:
        raise InputError(
            "\n".join([
                f"{len(errors)} of {len(files)} files cannot be read; repair or remove them, or "
                "leave them out by dataset.pattern:", *errors,
            ])
        )  # fmt: skip
    return [each for each in found if isinstance(each, _Read)]


def _read(file: Path, most: int) -> _Read | InputError:
    def points() -> tuple[PointCloud, int]:
        return without_zeros(read_cloud(file), file)

    try:
        cloud, dropped = points()
        kept, full = held(cloud, file, lambda: points()[0], most)
    except InputError as error:
        return error
    return _Read(
        Scan(file.name, kept.points, view_point=cloud.view_point, attributes=kept.attributes,
             full=full),
        dropped,
    )  # fmt: skip


def _few(names: list[str]) -> str:
    shown = ", ".join(names[:10]) or "nothing"
    return f"{shown} and {len(names) - 10} more" if len(names) > 10 else shown
