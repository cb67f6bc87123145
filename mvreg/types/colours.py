"""Colours from columns of numbers."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Array
from mvreg.types.attributes import COLOURS, Values


def colours(columns: Array) -> dict[str, Values]:
    """Colours (N, 3) by name, as ``uint8`` or else ``uint16``; empty where they are neither.

    They are ``uint8`` up to 255, so that a dark scan of 16 bits is told from one of 8 bits only by
    formats that say which it is.
    """
    top = columns.max(initial=0.0)
    if not (columns.min(initial=0.0) >= 0 and top <= 65535 and np.all(columns == columns.round())):
        return {}
    kind = np.uint8 if top <= 255 else np.uint16
    return {name: columns[:, i].astype(kind) for i, name in enumerate(COLOURS)}


def as_bytes(columns: Array) -> Array:
    """Colours (N, 3) from 0 to 1 as whole numbers up to 255; others as they are."""
    return np.rint(255 * columns) if columns.max(initial=0.0) <= 1 else columns
