"""The folder of a run whose result is there: first what counts, then what shows it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mvreg.errors import InputError
from mvreg.report import json_file
from mvreg.report.run_folder import (
    link_latest,
    take_place,
    write_models,
    write_part,
    write_placements,
)
from mvreg.types import Result, ScanSet, View


def write_run(
    folder: Path,
    scanset: ScanSet,
    result: Result,
    report: Mapping[str, Any],
    make_room: Callable[[], bool] = lambda: False,
) -> Path:
    """Write ``result.json``, poses and models; whoever sees the first finds the rest complete.

    Its place on the disk is taken first, its name given last. Where something cannot be written,
    `make_room` is asked to give up what is worth less; it says whether there was anything.

    Raises
    ------
    InputError
        If that does not help: names the file, what was saved, and what to do.
    """
    file = folder / "result.json"
    with saved_before(file, folder, ()):
        attempted(lambda: write_part(file, json_file.dumps(report)), make_room)
    try:
        with saved_before(folder / "poses", folder, ("result.json",)):
            attempted(lambda: write_placements(folder, scanset, result), make_room)
        with saved_before(folder / "model.ply", folder, ("result.json", "the poses")):
            attempted(lambda: write_models(folder, scanset, result), make_room)
    finally:
        take_place(file)
    return file


def attempted(write: Callable[[], None], make_room: Callable[[], bool]) -> None:
    """Write; once more if that fails and something else could be given up for it."""
    try:
        write()
    except (OSError, InputError):
        if not make_room():
            raise
        write()


@contextmanager
def saved_before(file: Path, folder: Path, saved: Sequence[str]) -> Iterator[None]:
    """What cannot be written becomes a message that says what was."""
    try:
        yield
    except (OSError, InputError) as error:
        reason = getattr(error, "strerror", None) or str(error).removeprefix(f"{file}: ")
        kept = ", ".join((*saved, "pairs.csv"))
        again = f"mvreg export {folder} ply" if saved else "the same command"
        raise InputError(
            f"cannot write {file}: {reason}; saved in {folder}: {kept}; make room on the disk, "
            f"then run {again}"
        ) from None


def show_run(
    folder: Path,
    scanset: ScanSet,
    report: Mapping[str, Any],
    views: Sequence[View],
    page: bool = True,
    link: bool = True,
) -> None:
    """Write ``report.html`` if a `page` is wanted, and let ``latest`` point to it for a `link`."""
    if page:
        from mvreg.report.page.render import write_page

        write_page(folder, report, scanset, views)
    if link:
        link_latest(folder)
