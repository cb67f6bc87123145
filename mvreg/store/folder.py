"""A store in a folder, bounded, for any number of processes at once; and the store of nothing."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from mvreg.errors import InputError, few
from mvreg.store import entries
from mvreg.store.codec import EntryError

#: The format of the entries, as a folder: another one begins anew.
EDITION = "1"
SUFFIX = ".safetensors"
#: What is removed at a time leaves so much of the bound free, so that it is not needed for each.
LEAVE = 0.9
#: The folder is measured again after so much of the bound was written.
MEASURE_AFTER = 0.1
#: Unfinished files older than this (seconds) belong to a process that is no more.
ABANDONED = 3600.0
#: An entry found is marked as used, if it was not for so long (seconds).
USED_AFTER = 3600.0


#: The environment variable that says where the store is.
PLACE = "MVREG_STORE"
GIGABYTE = 10**9


class Store(Protocol):
    """Finds and keeps values under keys."""

    def find(self, key: str, *more: type) -> Any | None:
        """The value kept under a key; None where there is none."""

    def keep(self, key: str, value: Any) -> None:
        """Keep a value; nothing happens where that is not possible."""


class NoStore:
    """Keeps nothing."""

    def find(self, key: str, *more: type) -> Any | None:
        """None."""
        return None

    def keep(self, key: str, value: Any) -> None:
        """Do nothing."""


@dataclass
class Use:
    """What a store was used for so far; `trouble` is what kept it from being used further."""

    found: int = 0
    kept: int = 0
    damaged: list[str] = field(default_factory=list)
    trouble: str = ""


class FolderStore:
    """A store in a folder.

    Any number of processes and machines may use it at once: an entry is the same whoever writes it,
    and comes into place whole. It is never in the way: where the disk is full or must not be
    written, `use` says so and the work goes on without it.

    Parameters
    ----------
    folder : Path
    most_bytes : int
        What it may take; what was not used for longest goes first.
    """

    def __init__(self, folder: Path, most_bytes: int) -> None:
        self.folder = folder / EDITION
        self.most_bytes = most_bytes
        self.use = Use()
        self._written = 0

    def __getstate__(self) -> dict[str, Any]:
        """For another process, which counts its own use."""
        return {**self.__dict__, "use": Use(), "_written": 0}

    def file(self, key: str) -> Path:
        """Where the entry of a key is, or would be."""
        return self.folder / key[:2] / f"{key}{SUFFIX}"

    def has(self, key: str) -> bool:
        """Whether there is an entry, which may be damaged."""
        return self.file(key).exists()

    def find(self, key: str, *more: type) -> Any | None:
        """The value kept under a key; None where there is none, or what is there is damaged."""
        file = self.file(key)
        try:
            value = entries.read(file, key, *more)
        except OSError:
            return None
        except EntryError as error:
            self.use.damaged.append(f"{file}: {error}")
            return None
        with suppress(OSError):
            if time.time() - file.stat().st_mtime > USED_AFTER:
                os.utime(file)
        self.use.found += 1
        return value

    def keep(self, key: str, value: Any) -> None:
        """Keep a value, and remove what was not used for longest where there is too much."""
        if self.use.trouble:
            return
        try:
            self._written += entries.write(self.file(key), key, value)
        except OSError as error:
            self.use.trouble = f"{self.folder}: {error.strerror or error}"
            return
        self.use.kept += 1
        if self._written > MEASURE_AFTER * self.most_bytes:
            self.shrink()

    def shrink(self) -> None:
        """Remove the entries that were not used for longest, if there is more than may be."""
        self._written = 0
        known = sorted(self.known())
        size = sum(bytes_ for _, bytes_, _ in known)
        if size <= self.most_bytes:
            return
        for _, bytes_, file in known:
            if size <= LEAVE * self.most_bytes:
                return
            with suppress(OSError):
                file.unlink()
                size -= bytes_

    def known(self) -> Iterator[tuple[float, int, Path]]:
        """When each entry was used last, its size in bytes, and its file.

        Removes what processes that are no more have left unfinished.
        """
        for folder in listed(self.folder):
            for file in listed(folder):
                with suppress(OSError):
                    stat = file.stat()
                    if file.suffix == SUFFIX:
                        yield stat.st_mtime, stat.st_size, file
                    elif (
                        file.suffix == entries.UNFINISHED
                        and time.time() - stat.st_mtime > ABANDONED
                    ):
                        file.unlink()

    def clear(self) -> tuple[int, int]:
        """Remove every entry; returns how many there were, and their size in bytes."""
        known = list(self.known())
        for _, _, file in known:
            file.unlink(missing_ok=True)
        return len(known), sum(bytes_ for _, bytes_, _ in known)


def listed(folder: Path) -> list[Path]:
    """What is in a folder; nothing where it is not, or not any more."""
    try:
        return list(folder.iterdir())
    except OSError:
        return []


def default_folder() -> Path:
    """Where finished work is kept: what ``MVREG_STORE`` says, or the user's cache."""
    from platformdirs import user_cache_path

    said = os.environ.get(PLACE)
    return Path(said).expanduser() if said else user_cache_path("mvreg") / "store"


def open_store(place: bool | str | Path, gigabytes: float) -> Store:
    """The store that is asked for.

    Parameters
    ----------
    place : bool or path
        False for none; True for the `default_folder`; or a folder.
    gigabytes : float
        What it may take.

    Raises
    ------
    InputError
        For a size that is not positive, or a place that is a file.
    """
    if place is False:
        return NoStore()
    if not gigabytes > 0:
        raise InputError(
            f"store_size={gigabytes}: expected a positive number of gigabytes; to keep nothing use "
            "store=false"
        )
    folder = default_folder() if place is True else Path(place).expanduser()
    if folder.exists() and not folder.is_dir():
        raise InputError(f"store={folder}: expected a folder, found a file; name another")
    return FolderStore(folder.absolute(), round(gigabytes * GIGABYTE))


def remarks_on(store: Store) -> tuple[str, ...]:
    """What a person is to know of a store after a run."""
    if not isinstance(store, FolderStore):
        return ()
    use, found = store.use, []
    if use.found:
        found.append(
            f"{use.found} finished pieces of work were found in {store.folder.parent} and not done "
            "again; store=false does all of it"
        )
    if use.damaged:
        found.append(f"entries of the store were damaged, and made again: {few(use.damaged, 3)}")
    if use.trouble:
        found.append(f"finished work could not be kept: {use.trouble}; see store=DIR, store=false")
    return tuple(found)
