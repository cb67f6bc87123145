"""The files of a folder: which can be read, and what else is there."""

from __future__ import annotations

import os
import re
from collections.abc import Collection
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from mvreg.errors import InputError, few

#: Kinds of files that lie beside scans and hold none: nobody misses them.
NO_SCANS = frozenset([
    "", ".md", ".rst", ".json", ".yaml", ".yml", ".toml", ".ini", ".cfg", ".conf", ".log", ".jpg",
    ".jpeg", ".png", ".gif", ".bmp", ".tif", ".tiff", ".pdf", ".doc", ".docx", ".html", ".py",
    ".sh", ".bat", ".mtl", ".rrd", ".db",
])  # fmt: skip
#: A folder that has one of these, or holds such folders as ``runs`` does, is of runs: models are
#: no scans.
OF_RUNS = (".hydra", "result.json", "*/*/*/.hydra", "*/*/*/result.json")


@dataclass(frozen=True)
class Listing:
    """What a folder holds, by names relative to it, sorted as people count.

    Parameters
    ----------
    files : tuple of str
        Those that match the pattern and can be read.
    others : tuple of str
        Those that match the pattern and cannot.
    folders : tuple of str
        Those that were not looked into.
    unmatched : tuple of str
        The files that do not match the pattern.
    packed : tuple of str
        Archives beside files that can be read, and compressed files beside the same one unpacked:
        their scans would count twice.
    """

    files: tuple[str, ...]
    others: tuple[str, ...]
    folders: tuple[str, ...]
    unmatched: tuple[str, ...]
    packed: tuple[str, ...] = ()

    @property
    def left_out(self) -> dict[str, str]:
        """Why each of the others was left out."""
        return {
            **dict.fromkeys(self.others, "of a kind that cannot be read"),
            **dict.fromkeys(self.packed, "packed, beside files that are not"),
            **{f"{name}/": "a folder" for name in self.folders},
        }

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is said of them: one sentence, or nothing where nobody misses any."""
        missed = [name for name in self.others if suffix(name) not in NO_SCANS]
        parts = []
        if missed:
            kinds = ", ".join(sorted({suffix(name) for name in missed}))
            what = "1 file was" if len(missed) == 1 else f"{len(missed)} files were"
            parts.append(f"{what} left out, of a kind that cannot be read: {kinds}")
        if self.packed:
            parts.append(f"packed files beside others left out: {few(list(self.packed), 5)}")
        if self.folders:
            what = "1 folder" if len(self.folders) == 1 else f"{len(self.folders)} folders"
            left = "" if missed else " left out"
            parts.append(
                f"{what}{left}: {few(list(self.folders), 5)} (dataset.recursive=true looks into it)"
            )
        return ("; ".join(parts),) if parts else ()


def find_files(folder: Path, pattern: str, recursive: bool, known: Collection[str]) -> Listing:
    """Look for files in a folder, and in those below it if `recursive`; hidden ones are none.

    Parameters
    ----------
    folder : Path
    pattern : str
        Of file names.
    recursive : bool
        Look into folders, too, except those of runs.
    known : collection of str
        The suffixes that can be read.

    Raises
    ------
    InputError
        If the folder cannot be read.
    """
    files: list[str] = []
    others: list[str] = []
    folders: list[str] = []
    unmatched: list[str] = []
    entries = _entries(folder, folder, recursive, folders)
    packed: list[str] = []
    archives: list[str] = []
    for entry in entries:
        inner = entry[: -len(suffix(entry))] if suffix(entry) == ".gz" else ""
        if not fnmatchcase(Path(entry).name, pattern):
            unmatched.append(entry)
        elif suffix(entry) == ".zip":
            archives.append(entry)
        elif inner and suffix(inner) in known:
            (packed if inner in entries else files).append(entry)
        else:
            (files if suffix(entry) in known else others).append(entry)
    (packed if files else files).extend(archives)
    found = (files, others, folders, unmatched, packed)
    in_order = [tuple(sorted(names, key=natural)) for names in found]
    return Listing(*in_order)


def _entries(folder: Path, top: Path, recursive: bool, folders: list[str]) -> list[str]:
    """The files of a folder; adds those that it does not look into to `folders`."""
    found: list[str] = []
    try:
        entries = list(os.scandir(folder))
    except OSError as error:
        raise InputError(
            f"dataset.path={folder}: expected a folder: {error.strerror or error}"
        ) from error
    for entry in entries:
        if entry.name.startswith("."):
            continue
        path = Path(entry.path)
        name = path.relative_to(top).as_posix()
        if entry.is_file():
            found.append(name)
        elif not entry.is_dir() or any(next(path.glob(sign), None) for sign in OF_RUNS):
            continue
        elif not recursive or entry.is_symlink():
            folders.append(name)
        else:
            found += _entries(path, top, recursive, folders)
    return found


def suffix(name: str) -> str:
    """Of a file's name, in lower case."""
    return Path(name).suffix.lower()


def natural(name: str) -> tuple[list[tuple[int, str]], str]:
    """A key that sorts names as people count; the name itself settles ties."""
    parts = re.findall(r"[0-9]+|[^0-9]+", name.casefold())
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts], name
