"""Names of scans in sentences."""

from __future__ import annotations

from collections.abc import Sequence


def named(names: Sequence[str]) -> str:
    """The first of many names: ``a.ply``, ``a.ply and b.ply``, ``a.ply and 5 more``."""
    if len(names) > 2:
        return f"{names[0]} and {len(names) - 1} more"
    return " and ".join(names)
