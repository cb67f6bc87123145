"""Colours from columns of numbers."""

from __future__ import annotations

import numpy as np

from mvreg.types import Array
from mvreg.types.attributes import Values

COLOURS = ("red", "green", "blue")


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
