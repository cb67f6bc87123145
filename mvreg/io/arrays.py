"""Read points from NumPy's own files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.types import Array


def read_npy(path: Path) -> Array:
    """Read an array (N, 3 or more) from NPY, or `points` or the only array from NPZ.

    Raises
    ------
    InputError
        With file and reason. Pickled objects are refused: they can run code.
    """
    try:
        array = _load(path)
    except (InputError, OSError, MemoryError):
        raise
    except Exception as error:  # zipfile, zlib, struct, pickle and NumPy raise as they please
        raise InputError(f"{path}: not a readable NumPy file: {error}") from error
    if array.dtype.kind not in "iuf":
        raise InputError(f"{path}: expected real numbers, got dtype {array.dtype}")
    if array.ndim != 2 or array.shape[1] < 3:
        raise InputError(f"{path}: expected an array (N, 3), got {array.shape}")
    return array[:, :3].astype(np.float64)


def _load(path: Path) -> np.ndarray[Any, Any]:
    with path.open("rb") as stream:
        content = np.load(stream, allow_pickle=False)
        if isinstance(content, np.ndarray):
            return content
        names = list(content.files)
        if "points" in names:
            return np.asarray(content["points"])
        if len(names) == 1:
            return np.asarray(content[names[0]])
    raise InputError(f"{path}: expected one array, or one named 'points'; found {names}")
