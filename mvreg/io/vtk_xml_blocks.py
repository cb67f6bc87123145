"""What stands behind the header of an array in VTK's XML files, and base64."""

from __future__ import annotations

import binascii
import lzma
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError


def _inflate(block: bytes, most: int) -> bytes:
    return zlib.decompressobj().decompress(block, most)


def _unxz(block: bytes, most: int) -> bytes:
    return lzma.LZMADecompressor().decompress(block, most)


#: By the name of VTK's compressor: ``(block, most bytes)`` to what it holds.
COMPRESSORS: dict[str, Callable[[bytes, int], bytes]] = {
    "vtkZLibDataCompressor": _inflate, "vtkLZMADataCompressor": _unxz,
}  # fmt: skip


@dataclass(frozen=True)
class Packing:
    """How the bytes of arrays are packed.

    Parameters
    ----------
    header : str
        NumPy's code of the numbers that stand before an array: its size in bytes, or the number
        of its blocks and their sizes.
    compressor : str
        One of `COMPRESSORS`, or empty.
    most : int
        Bytes of one array; more are refused.
    """

    header: str
    compressor: str
    most: int

    def unpack(self, data: memoryview, where: str) -> bytes | memoryview:
        """The bytes of the array whose header `data` begins with; what follows is passed over.

        Raises
        ------
        InputError
            If there is less than the header says, or it cannot be uncompressed.
        """
        count = self._head(data, 1, 0, where)[0]
        if self.compressor:
            return b"".join(self._blocks(data, count, where)) if count else b""
        start = np.dtype(self.header).itemsize
        found = data[start : start + count]
        if len(found) < count:
            raise short(where, count, len(found))
        return found

    def _blocks(self, data: memoryview, count: int, where: str) -> list[bytes]:
        item = np.dtype(self.header).itemsize
        whole, last = self._head(data, 2, item, where)
        sizes = self._head(data, count, 3 * item, where)
        lengths = [whole] * (count - 1) + [last or whole]
        if sum(lengths) > self.most:
            raise InputError(
                f"{where}: {sum(lengths)} bytes are announced, expected at most {self.most} in a "
                "file of this size; it is damaged"
            )
        at = (3 + count) * item
        parts = []
        for size, length in zip(sizes, lengths, strict=True):
            try:
                part = COMPRESSORS[self.compressor](bytes(data[at : at + size]), length or 1)
            except (zlib.error, lzma.LZMAError, EOFError) as error:
                raise InputError(f"{where}: cannot be unpacked: {error}; it is damaged") from error
            if len(part) != length:
                raise short(where, length, len(part))
            parts.append(part)
            at += size
        return parts

    def _head(self, data: memoryview, count: int, start: int, where: str) -> list[int]:
        need = start + count * np.dtype(self.header).itemsize
        if need > len(data):
            raise short(where, need, len(data))
        found: list[int] = np.frombuffer(data, self.header, count, start).tolist()
        return found


def short(where: str, expected: int, found: int) -> InputError:
    """There are not as many bytes as there should be."""
    return InputError(
        f"{where}: expected {expected} bytes, found {found}; the file is truncated or damaged"
    )


def from_base64(text: bytes, where: str) -> memoryview:
    """What base64 holds; VTK encodes headers by themselves, so that padding may be within it.

    Raises
    ------
    InputError
        If it is no base64, or cut off.
    """
    parts = re.split(rb"(?<==)(?!=)", b"".join(text.split()))
    try:
        found = [binascii.a2b_base64(part, strict_mode=True) for part in parts if part]
    except binascii.Error as error:
        raise InputError(f"{where}: expected base64: {error}; the file is damaged") from error
    return memoryview(b"".join(found))
