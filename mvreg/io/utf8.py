"""Text files that are small enough to be read at once."""

from __future__ import annotations

from pathlib import Path

from mvreg.errors import InputError


def read_utf8(path: Path) -> str:
    """The text of a file in UTF-8, without its byte order mark.

    Raises
    ------
    InputError
        If the file cannot be read, or is in another encoding.
    """
    try:
        return path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected text in UTF-8: {error}") from error
