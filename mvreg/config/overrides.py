"""Overrides in the spelling of Hydra's grammar, from plain values."""

from __future__ import annotations

from collections.abc import Mapping


def overrides_from(changes: Mapping[str, object]) -> list[str]:
    """Hydra's spelling of ``{"seed.top_fraction": 0.5, "refine": "icp"}``."""
    return [f"{key}={spelled(value)}" for key, value in changes.items()]


def spelled(value: object) -> str:
    """One value as Hydra's override grammar reads it; text is quoted, lest 1e5 become a number."""
    from hydra.core.override_parser.types import Quote, QuotedString

    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "{" + ",".join(f"{key}:{spelled(v)}" for key, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ",".join(spelled(v) for v in value) + "]"
    if isinstance(value, int | float):
        return str(value)
    quoted: str = QuotedString(str(value), Quote.single).with_quotes()
    return quoted
