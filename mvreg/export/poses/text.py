"""What the writers of text share: numbers, lists of names, file names."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from mvreg.export.placements import Component, Placements
from mvreg.report.run_folder import pose_files, write_text
from mvreg.types import Array


def words(numbers: Iterable[float]) -> str:
    """Numbers with blanks between, each the shortest text that reads back to the same double."""
    return " ".join(repr(float(number)) for number in numbers)


def rows(matrix: Array) -> str:
    """A matrix as lines of numbers, each ended."""
    return "".join(f"{words(row)}\n" for row in matrix)


def write_names(path: Path, component: Component, placements: Placements) -> None:
    """The scans of a format that knows no names: a line per pose, in its order.

    ``INDEX NUMBER NAME``: the index in the file and the scan's number in the data set, from 0.
    """
    write_text(path, "".join(
        f"{index}\t{placements.number(name)}\t{name}\n"
        for index, name in enumerate(component.poses)
    ))  # fmt: skip


def stems(placements: Placements) -> dict[str, str]:
    """A file name without ending for each scan, the same in every export."""
    return {name: file.removesuffix(".txt") for name, file in pose_files(placements.names).items()}


def one_line(name: str) -> str:
    """A name that ends no line: control characters become underscores."""
    return "".join(letter if letter.isprintable() else "_" for letter in name)
