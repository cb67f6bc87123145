"""The words and numbers of a legacy VTK file, one after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError
from mvreg.io.stations import Lines
from mvreg.io.table import as_declared, excerpt, parse_lines
from mvreg.kernels.text import parse_rows
from mvreg.types.attributes import Values

#: VTK's names of types and NumPy's; VTK writes its ids as ``int``.
TYPES = {
    "char": "i1", "signed_char": "i1", "unsigned_char": "u1", "short": "i2",
    "unsigned_short": "u2", "int": "i4", "unsigned_int": "u4", "vtkidtype": "i4",
    "long": "i8", "unsigned_long": "u8", "vtktypeint64": "i8", "vtktypeuint64": "u8",
    "float": "f4", "double": "f8", "bit": "bit", "string": "string",
}  # fmt: skip
#: How many bytes tell the length of a string, by the two highest bits of the first.
_LENGTH = {3: 1, 2: 2, 1: 4, 0: 8}


@dataclass
class Words(Lines):
    """A legacy VTK file, read from its beginning to its end: its lines, and arrays of numbers."""

    binary: bool = False

    def section(self) -> list[str]:
        """The words of the next line that is not blank; none at the end of the file."""
        while self.at < len(self.data):
            words = self.peek().split()
            if words and words != ["\0"]:
                return words
            self.next()
        return []

    def skip_metadata(self) -> None:
        """Go past a block METADATA, which ends at a blank line."""
        while self.at < len(self.data) and self.next().strip():
            pass

    def numbers(self, count: int, kind: str, what: str) -> Values:
        """The next `count` numbers of one of VTK's types; single precision in text as doubles.

        Raises
        ------
        InputError
            With file, line or byte, and reason; before anything is allocated for a count that the
            rest of the file is too short for.
        """
        code = TYPES.get(kind.lower())
        if code is None:
            raise InputError(
                f"{self.path}, line {self.number}: expected {what} of a type {', '.join(TYPES)}; "
                f"got {excerpt(kind)}"
            )
        if code == "string":
            self._skip_strings(count, what)
            return np.empty(0)
        if count == 0:
            return np.empty(0, "u1" if code == "bit" else code)
        return self._binary(count, code, what) if self.binary else self._text(count, code, what)

    def _binary(self, count: int, code: str, what: str) -> Values:
        kind = np.dtype("u1" if code == "bit" else ">" + code)
        size = (count + 7) // 8 if code == "bit" else count * kind.itemsize
        left = len(self.data) - self.at
        if size > left:
            raise self._short(what, count, f"{left} bytes of {size}")
        values = np.frombuffer(self.data, kind, size // kind.itemsize, self.at)
        self.at += size
        if self.data[self.at : self.at + 1] == b"\n":
            self.next()
        return np.unpackbits(values, count=count) if code == "bit" else values.astype(code)

    def _text(self, count: int, code: str, what: str) -> Values:
        """Numbers may be broken into lines anywhere; VTK writes nine a line."""
        if 2 * count > len(self.data) - self.at + 1:
            raise self._short(what, count, f"{len(self.data) - self.at} bytes")
        words, end = self._split(count)
        if len(words) < count:
            raise self._short(what, count, f"{len(words)} numbers")
        parsed = parse_rows(b"\n".join(words), 0, count, 1)
        if parsed is None:
            numbered = ((self.number, word.decode("latin-1")) for word in words)
            values = parse_lines(numbered, 1, self.path)[:, 0]
        else:
            values = parsed[0][:, 0]
        if len(values) < count:  # a word that begins as a comment does
            raise self._short(what, count, f"{len(values)} numbers")
        self.number += self.data.count(b"\n", self.at, end)
        self.at = end
        return as_declared(values, np.dtype("u1" if code == "bit" else code))

    def _split(self, count: int) -> tuple[list[bytes], int]:
        """The next `count` words, or all that there are, and where they end."""
        window = 16 * count + 4096
        while True:
            piece = self.data[self.at : self.at + window]
            words = piece.split(None, count)
            whole = self.at + len(piece) == len(self.data)
            if len(words) > count:
                return words[:count], self.at + len(piece) - len(words[count])
            if whole:
                return words, len(self.data)
            window *= 2

    def _skip_strings(self, count: int, what: str) -> None:
        """In text one a line; in binary files each after its length."""
        for done in range(count):
            if self.at >= len(self.data):
                raise self._short(what, count, f"{done} strings")
            if not self.binary:
                self.next()
                continue
            size = _LENGTH[self.data[self.at] >> 6]
            head = int.from_bytes(self.data[self.at : self.at + size], "big")
            self.at = min(self.at + size + (head & (1 << (8 * size - 2)) - 1), len(self.data))

    def _short(self, what: str, count: int, found: str) -> InputError:
        return InputError(
            f"{self.path}, line {self.number}: expected {what}, {count} numbers; found {found}; "
            "the file is truncated or the number is wrong"
        )
