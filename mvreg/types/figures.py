"""Numbers for people to read."""

from __future__ import annotations

from decimal import Decimal


def significant(value: float, digits: int = 3) -> str:
    """A number with so many significant digits, without an exponent: 7,400 and not 7.4e+03."""
    return f"{Decimal(f'{value:.{digits}g}'):,f}"
