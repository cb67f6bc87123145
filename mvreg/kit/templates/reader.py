"""A file format: ``.nameless`` files are read as scans."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io import Format, PointCloud, ReadOptions


def read_nameless(path: Path, options: ReadOptions) -> Sequence[PointCloud]:
    """Read a file: a line ``nameless N``, then N lines with x, y, z and an intensity.

    Parameters
    ----------
    path : Path
    options : ReadOptions
        What a user may say of all files of a folder; not used.

    Returns
    -------
    sequence of PointCloud
        The one scan of the file: points (N, 3) in the unit of the file, and their ``intensity``.

    Raises
    ------
    InputError
        With file, place and reason: a damaged file is never an empty scan.
    """
    try:
        head, *lines = path.read_text(encoding="utf-8").splitlines()
    except (ValueError, UnicodeDecodeError):
        raise InputError(f"{path}: expected text that begins with 'nameless N', got none") from None
    words = head.split()
    if len(words) != 2 or words[0] != "nameless" or not words[1].isdecimal():
        raise InputError(f"{path}:1: expected 'nameless' and a number of points, got {head!r}")
    if len(lines) != int(words[1]):
        raise InputError(f"{path}: expected {words[1]} lines of points, got {len(lines)}")
    rows = np.empty((len(lines), 4))
    for number, line in enumerate(lines):
        try:
            rows[number] = [float(word) for word in line.split()]
        except ValueError:
            raise InputError(
                f"{path}:{number + 2}: expected x, y, z and an intensity, got {line!r}"
            ) from None
    return (PointCloud(rows[:, :3].copy(), attributes={"intensity": rows[:, 3].copy()}),)


#: The format as mvreg registers it; a suffix that mvreg reads itself would be replaced.
NAMELESS = Format("nameless", (".nameless",), read_nameless)
