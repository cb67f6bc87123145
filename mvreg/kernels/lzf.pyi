"""Decompression of LZF."""

from typing import Any

import numpy as np

def decompress(data: bytes | memoryview, size: int) -> np.ndarray[Any, np.dtype[np.uint8]] | None:
    """Decompress data of LibLZF's format.

    Parameters
    ----------
    data : bytes or memoryview
    size : int
        Bytes that must come out; at most 100 times those of `data`.

    Returns
    -------
    (size,) array of uint8

    None instead where the data are not LZF, or another number of bytes.
    """
