"""The pages of an E57 file, with their checksums.

As ASTM E2807 has it: a file is of pages of 1024 bytes, of which the last four are a CRC-32C of the
others, the payload.
"""

from __future__ import annotations

import os
import struct
from functools import cache

PAGE, CHECKSUM = 1024, 4
PAYLOAD = PAGE - CHECKSUM


class Pages:
    """The payload of a file's pages, as if it were in one piece."""

    def __init__(self, file: int) -> None:
        self.file = file

    def read(self, first: int, size: int) -> bytes:
        """Bytes of the payload."""
        found = b"".join(
            self.page(number) for number in range(first // PAYLOAD, -(-(first + size) // PAYLOAD))
        )
        return found[first % PAYLOAD :][:size]

    def page(self, number: int) -> bytes:
        """The payload of a page; zeros of one that is not there yet."""
        return os.pread(self.file, PAYLOAD, number * PAGE).ljust(PAYLOAD, b"\0")

    def write(self, first: int, content: bytes) -> None:
        """Change the payload, with the checksums of its pages."""
        while content:
            number, offset = divmod(first, PAYLOAD)
            part = content[: PAYLOAD - offset]
            page = bytearray(self.page(number))
            page[offset : offset + len(part)] = part
            # The checksum is big endian, unlike all else.
            os.pwrite(self.file, bytes(page) + struct.pack(">I", crc32c(page)), number * PAGE)
            first, content = first + len(part), content[len(part) :]


def logical(physical: int) -> int:
    """Where a place in the file is in the payload."""
    return physical // PAGE * PAYLOAD + physical % PAGE


@cache
def _table() -> list[int]:
    """CRC-32C (Castagnoli), reflected, byte by byte."""
    found = []
    for byte in range(256):
        for _ in range(8):
            byte = byte >> 1 ^ (0x82F63B78 if byte & 1 else 0)
        found.append(byte)
    return found


def crc32c(content: bytes | bytearray) -> int:
    """The checksum of a page's payload."""
    table, value = _table(), 0xFFFFFFFF
    for byte in content:
        value = table[(value ^ byte) & 255] ^ value >> 8
    return value ^ 0xFFFFFFFF
