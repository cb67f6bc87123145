"""How a table of text is laid out: where it begins, what parts its columns."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from mvreg.errors import NoScanError
from mvreg.io.table import as_float, excerpt
from mvreg.io.text_numbers import Numbers, may_hold_commas, numbers_in

COMMENT = ("#", "//", "%", "!")
#: So many rows tell the layout; so many lines before them are kept for their names.
ROWS, LINES = 100, 20
_QUOTED_PART = re.compile(r"\"\s*([;,\t|])\s*\"")
_BETWEEN = re.compile(r"[\s;,|\"]+")


@dataclass(frozen=True)
class Layout:
    """How a table is laid out.

    Parameters
    ----------
    start, number : int
        Where in the data the first row begins, and the number of its line, from 1.
    heading : tuple of str
        The lines before it, the last first.
    part : str
        What parts the columns; empty for blanks.
    quoted : bool
        Cells are in double quotes.
    numbers : Numbers
    columns : int
        As many as the longest of the first rows has.
    words : frozenset of int
        The columns that hold no number in any of these.
    """

    start: int
    number: int
    heading: tuple[str, ...]
    part: str
    quoted: bool
    numbers: Numbers
    columns: int
    words: frozenset[int]

    @property
    def blanks(self) -> dict[int, str | None]:
        """For `str.translate`: blanks between the columns, numbers as `float` reads them."""
        table: dict[int, str | None] = {ord(char): None for char in self.numbers.groups}
        if self.quoted:
            table[ord('"')] = " "
        table[ord(self.numbers.decimal)] = "."
        if self.part:
            table[ord(self.part)] = " "
        return table

    @property
    def is_plain(self) -> bool:
        """Whether blanks can part all cells: what parts them is in none of them."""
        inside = self.numbers.groups + self.numbers.decimal
        return (self.part or " ") not in inside and not self.words and inside.isascii()

    def cells(self, line: str) -> list[str]:
        """The cells of one line; an empty one behind the last column is none."""
        found = split(line, self.part, self.quoted)
        while len(found) > self.columns and not found[-1]:
            found.pop()
        return found


def split(line: str, part: str, quoted: bool) -> list[str]:
    """A line cut into cells."""
    if quoted:
        try:
            rows = list(csv.reader([line], delimiter=part or " ", skipinitialspace=True))
        except csv.Error:
            return line.split(part or None)
        return [cell.strip() for cell in rows[0]] if rows else []
    return [cell.strip() for cell in line.split(part)] if part else line.split()


def find_layout(data: bytes, path: Path) -> Layout:
    """Find the first row with three numbers, and how it and those after it are laid out.

    A line that has words, too, is one if the next looks like it.

    Raises
    ------
    NoScanError
        If there is none; shows the first line that could have been.
    """
    heading: list[str] = []
    suspect: tuple[int, str] | None = None
    stream = BytesIO(data)
    for number, line in enumerate(stream, 1):
        text = line.decode("utf-8", "replace").strip()
        if not text:
            continue
        if not text.startswith(COMMENT):
            start = stream.tell() - len(line)
            if _may_be_row(text) and (found := _layout(data, start, number, heading)):
                return found
            if suspect is None or _begins(text) > _begins(suspect[1]):
                suspect = number, text
        heading = [text, *heading[: LINES - 1]]
    where, shown = "", ", found none"
    if suspect is not None:
        where, shown = f", line {suspect[0]}", f", got {excerpt(suspect[1])}"
    raise NoScanError(f"{path}{where}: expected lines of at least 3 numbers{shown}")


def _may_be_row(text: str) -> bool:
    """Whether a line has three words that may be numbers; cheap, for long texts."""
    return sum(as_float(word) is not None for word in _BETWEEN.split(text)) >= 3


def _begins(text: str) -> bool:
    """Whether a line begins as a row of numbers does."""
    return Numbers().value(re.split(r"[\s,;\"]", text.lstrip("\"'"))[0] or "x") is not None


def _layout(data: bytes, start: int, number: int, heading: list[str]) -> Layout | None:
    """The layout of the table that begins here; None where none does."""
    lines = _sample(data, start)
    part, quoted = _part(lines[0])
    rows = [split(line, part, quoted) for line in lines]
    numbers = numbers_in(cell for row in rows for cell in row)
    where = [_numeric(row, numbers) for row in rows]
    if len(where[0]) < 3:
        return None
    if not any(row[-1] for row in rows):  # each row ends in what parts the columns
        rows = [row[:-1] for row in rows]
    mixed = len(where[0]) < len(rows[0])
    if mixed and len(rows) > 1 and len(where[0] & where[1]) < 3:
        return None
    columns = max(map(len, rows))
    words = frozenset(range(columns)) - frozenset().union(*where)
    return Layout(start, number, tuple(heading), part, quoted, numbers, columns, words)


def _sample(data: bytes, start: int) -> list[str]:
    """The first rows from `start` on."""
    found: list[str] = []
    for text in _lines(data, start):
        if text and not text.startswith(COMMENT):
            found.append(text)
            if len(found) == ROWS:
                break
    return found


def _lines(data: bytes, start: int) -> Iterator[str]:
    while start < len(data):
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        yield data[start:end].decode("utf-8", "replace").strip()
        start = end + 1


def _part(line: str) -> tuple[str, bool]:
    """What parts the cells of a row, and whether they are quoted."""
    if '"' in line:
        found = _QUOTED_PART.search(line)
        bare = re.sub(r"\"[^\"]*\"?", "x", line)
        return (found[1] if found else _part(bare)[0]), True
    if ";" in line:
        return ";", False
    words = line.split()
    if "," in line and not (len(words) >= 3 and all(map(_one_number, words))):
        return ",", False
    for part in "\t|":
        if line.count(part) >= 2:
            return part, False
    return "", False


def _one_number(word: str) -> bool:
    return "," not in word or may_hold_commas(word)


def _numeric(row: Iterable[str], numbers: Numbers) -> frozenset[int]:
    """The places of the numbers in a row."""
    return frozenset(
        place for place, cell in enumerate(row) if cell and numbers.value(cell) is not None
    )
