"""Reference of `mvreg.kernels.text`."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Array


def parse_rows(data: bytes, start: int, rows: int, columns: int) -> tuple[Array, int] | None:
    """As `mvreg.kernels.text.parse_rows`."""
    lines = data[start:].split(b"\n", max(rows, 0))[: max(rows, 0)]
    words = [line.split() for line in lines]
    if rows < 1 or columns < 1 or len(lines) < rows or any(len(row) != columns for row in words):
        return None
    if b"_" in b"".join(lines):  # `float` takes 1_000
        return None
    try:
        table = np.array([[float(word) for word in row] for row in words])
    except ValueError:
        return None
    return table, min(start + sum(len(line) + 1 for line in lines), len(data))
