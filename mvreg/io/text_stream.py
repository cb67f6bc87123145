"""Tables of text read block by block: how they are laid out, and their rows."""

from __future__ import annotations

import codecs
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from itertools import chain
from pathlib import Path

from mvreg.errors import InputError, NoScanError
from mvreg.io.pieces import text_blocks
from mvreg.io.text_layout import Layout, find_layout
from mvreg.io.text_rows import parse_table
from mvreg.types import Array

#: The longer mark first: that of UTF-32 begins with that of UTF-16.
_MARKS = {
    codecs.BOM_UTF32_LE: "utf-32", codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class TextTable:
    """A table that is read as it is gone through, once.

    Parameters
    ----------
    path : Path
    layout : Layout
    first : bytes
        What the layout was found in, the beginning of the text.
    more : iterator of bytes
        The blocks behind it.
    """

    path: Path
    layout: Layout
    first: bytes
    more: Iterator[bytes]

    @property
    def row_length(self) -> float:
        """Bytes of a row, on average over the first ones."""
        body = self.first[self.layout.start :]
        return len(body) / max(1, body.count(b"\n"))

    def rows(self, axes: Sequence[int]) -> Iterator[Array]:
        """All rows in tables (N, columns), see `parse_table`.

        Raises
        ------
        InputError
            With file, line and reason.
        """
        number = self.layout.number
        for block in chain([self.first[self.layout.start :]], self.more):
            yield parse_table(block, number, self.layout, axes, self.path)
            number += block.count(b"\n")


def open_table(path: Path) -> TextTable:
    """Find how a table is laid out: in its first block, or else in all of it.

    Raises
    ------
    NoScanError
        If there is no row of three numbers.
    InputError
        If the text is not in the encoding that its mark says.
    """
    blocks = _blocks(path)
    first = next(blocks, b"")
    try:
        layout = find_layout(first, path)
    except NoScanError:
        rest = b"".join(blocks)
        if not rest:
            raise
        first += rest
        layout = find_layout(first, path)
    return TextTable(path, layout, first, blocks)


def _blocks(path: Path) -> Iterator[bytes]:
    """The text in UTF-8, with a line feed after each line, in blocks of whole lines."""
    with path.open("rb") as stream:
        head = stream.read(4)
        encoding = next((name for mark, name in _MARKS.items() if head.startswith(mark)), None)
        stream.seek(len(codecs.BOM_UTF8) if head.startswith(codecs.BOM_UTF8) else 0)
        source = stream if encoding is None else BytesIO(_decoded(stream.read(), encoding, path))
        for block in text_blocks(source):
            yield block.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _decoded(data: bytes, encoding: str, path: Path) -> bytes:
    try:
        return data.decode(encoding).encode()
    except UnicodeError as error:
        raise InputError(f"{path}: expected text in {encoding}: {error}") from error
