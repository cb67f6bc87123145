"""Text files in which several scans follow each other: what PTX and PTS share."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.table import excerpt, parse_lines
from mvreg.kernels.text import parse_rows
from mvreg.types import Array


@dataclass
class Lines:
    """A text that is read from its beginning to its end: byte `at` begins line `number`."""

    data: bytes
    path: Path
    at: int = 0
    number: int = 1

    @classmethod
    def of(cls, path: Path) -> Lines:
        """The text of a file, with any line breaks."""
        data = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
        return cls(data if b"\n" in data else data.replace(b"\r", b"\n"), path)

    def skip_blank(self) -> bool:
        """Go on to the next line that is not blank; whether there is one."""
        found = re.compile(rb"[\s\0\x1a]*").match(self.data, self.at)
        end = found.end() if found else self.at
        if end >= len(self.data):
            return False
        start = self.data.rfind(b"\n", self.at, end) + 1 or self.at
        self.number += self.data.count(b"\n", self.at, start)
        self.at = start
        return True

    def peek(self) -> str:
        """The line at hand."""
        end = self.data.find(b"\n", self.at)
        return self.data[self.at : len(self.data) if end < 0 else end].decode("latin-1")

    def next(self) -> str:
        """The line at hand, and go on to the next."""
        line = self.peek()
        self.at = min(self.at + len(line) + 1, len(self.data))
        self.number += 1
        return line

    def table(self, rows: int, columns: int) -> Array:
        """The next `rows` (at least 1) lines of numbers, and go on to what follows.

        Raises
        ------
        InputError
            With file, line and reason; before anything is allocated for an absurd number of rows.
        """
        if rows > (len(self.data) - self.at + 1) // 2 // columns:
            raise InputError(
                f"{self.path}, line {self.number}: {rows} points are announced, but only "
                f"{len(self.data) - self.at} bytes follow; the file is truncated or the number is "
                "wrong"
            )
        parsed = parse_rows(self.data, self.at, rows, columns)
        if parsed is not None:
            self.at, self.number = parsed[1], self.number + rows
            return parsed[0]
        lines = self._rest()
        table = parse_lines(lines, columns, self.path, rows)
        if len(table) < rows:
            raise InputError(
                f"{self.path}, line {self.number}: the file ends after {len(table)} of {rows} "
                "points; it is truncated"
            )
        return table

    def _rest(self) -> Iterator[tuple[int, str]]:
        """The lines to come, each passed once it is asked for."""
        stream = BytesIO(self.data)
        stream.seek(self.at)
        for line in stream:
            self.at += len(line)
            self.number += 1
            yield self.number - 1, line.decode("latin-1").rstrip("\n\0\x1a")

    def error(self, expected: str) -> InputError:
        """At this line something else was expected."""
        return InputError(
            f"{self.path}, line {self.number}: expected {expected}, got {excerpt(self.peek())}"
        )


def with_points(clouds: Sequence[PointCloud], path: Path) -> tuple[PointCloud, ...]:
    """The scans that have points; which ones have none, the first one's remarks say.

    Raises
    ------
    InputError
        If no scan has any.
    """
    kept = [each for each in clouds if np.isfinite(each.points).all(axis=1).any()]
    if not kept:
        raise InputError(
            f"{path}: expected points, found none in {len(clouds)} scan(s); leave this file out"
        )
    empty = [each.name or "unnamed" for each in clouds if each not in kept]
    if empty:
        left_out = f"{len(empty)} scan(s) without points left out: {', '.join(empty[:10])}"
        kept[0] = replace(kept[0], remarks=(*kept[0].remarks, left_out))
    return tuple(kept)
