"""Download an archive of scans into the user's cache."""

from __future__ import annotations

import logging
import shutil
import tarfile
import tempfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

from mvreg.errors import InputError


def cache_folder() -> Path:
    """Where downloaded data sets are kept, as the platform has it."""
    from platformdirs import user_cache_path

    return Path(user_cache_path("mvreg", appauthor=False)) / "datasets"


def download(url: str, names: Iterable[str], target: Path) -> None:
    """Download a ``.tar.gz``, with a progress bar on stderr, and keep the files wanted.

    All happens in a folder beside `target`, which is renamed at the very end: `target` is whole
    or not there. Only plain files with the names asked for are taken from the archive, and their
    paths in it are ignored, so that nothing it says can write elsewhere.

    Parameters
    ----------
    url : str
        Address of the archive.
    names : iterable of str
        Names of the files to take, without folders.
    target : Path
        The folder to make. One that is there already is replaced.

    Raises
    ------
    InputError
        If the archive cannot be had, is damaged, or lacks a file.
    """
    wanted = set(names)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{target.name}-", dir=target.parent) as work:
            archive = _retrieve(url, Path(work))
            fresh = Path(work) / "files"
            fresh.mkdir()
            missing = wanted - _unpack(archive, wanted, fresh)
            if missing:
                raise InputError(f"{url} lacks {', '.join(sorted(missing))}")
            _install(fresh, target)
    except (tarfile.TarError, EOFError, zlib.error) as error:
        raise InputError(f"{url}: not an archive that can be unpacked: {error}") from error
    except OSError as error:  # also what requests raises, and gzip on damage
        raise InputError(f"{url}: {error}") from error


def _retrieve(url: str, folder: Path) -> Path:
    import pooch
    from requests.exceptions import ConnectionError as NoConnectionError

    # It announces at level INFO what the bar shows anyway.
    pooch.get_logger().setLevel(logging.WARNING)
    with _progress(f"downloading {PurePosixPath(url).name}") as bar:
        # The repository publishes no checksums; gzip's own find accidents.
        downloader = pooch.HTTPDownloader(progressbar=bar, timeout=30)
        try:
            path = pooch.retrieve(
                url, known_hash=None, fname="archive", path=folder, downloader=downloader
            )
        except NoConnectionError as error:  # its own text is three lines of nested classes
            raise InputError(f"{url}: no connection to the server") from error
    return Path(path)


@contextmanager
def _progress(label: str) -> Iterator[_Bar]:
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn

    columns = TextColumn("{task.description}"), BarColumn(), DownloadColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        yield _Bar(progress, label)


class _Bar:
    """What pooch asks of a progress bar, drawn by rich."""

    def __init__(self, progress: Any, label: str) -> None:
        self._progress = progress
        self._task = progress.add_task(label, total=None)
        self.total: float = 0

    def update(self, amount: float) -> None:
        self._progress.update(self._task, total=self.total or None, advance=amount)

    def reset(self) -> None:
        self._progress.reset(self._task)

    def close(self) -> None:
        self._progress.refresh()


def _unpack(archive: Path, wanted: set[str], folder: Path) -> set[str]:
    """Copy the plain files named so out of the archive, and say which there were."""
    found = set()
    with tarfile.open(archive, "r:*") as content:
        for member in content:
            name = PurePosixPath(member.name).name
            stream = content.extractfile(member) if member.isreg() and name in wanted else None
            if stream is not None:
                with stream, (folder / name).open("wb") as file:
                    shutil.copyfileobj(stream, file)
                found.add(name)
        # The checksum stands at the very end, past what tarfile looks at: read up to it.
        while content.fileobj is not None and content.fileobj.read(1 << 20):
            pass
    return found


def _install(fresh: Path, target: Path) -> None:
    """Put the new folder in the place of whatever is there."""
    if target.exists():
        target.replace(fresh.with_name("old"))  # goes with the working folder
    fresh.replace(target)
