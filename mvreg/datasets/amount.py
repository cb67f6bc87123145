"""Amounts: all, a number, a share, or a random one between two of these."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError

BOUND = r"all|\d+|\d+(?:\.\d+)?%"
PATTERN = re.compile(rf"({BOUND})(?:-({BOUND}))?")


@dataclass(frozen=True)
class Amount:
    """How many of some things are wanted: ``all``, ``3``, ``50%``, ``2-5``, ``20%-all``.

    Of a range, every number in it is as probable. A share is rounded, and never to none.

    Parameters
    ----------
    key : str
        The parameter, for messages.
    text : str

    Raises
    ------
    InputError
        If the text is none of these.
    """

    key: str
    text: str

    def __post_init__(self) -> None:
        match = PATTERN.fullmatch(self.text)
        shares = [float(share) for share in re.findall(r"([\d.]+)%", self.text)]
        if match is None or any(share > 100 for share in shares):
            raise InputError(
                f"{self.key}={self.text!r}: expected all, a number as 3, a share as 50%, or a "
                "range of these as 2-5"
            )

    def draw(self, total: int, rng: np.random.Generator, things: str) -> int:
        """How many of `total` things, which messages call `things`.

        Raises
        ------
        InputError
            If fewer than one or more than all of them are asked for, or a range is reversed.
        """
        low, _, high = self.text.partition("-")
        bounds = _count(low, total), _count(high or low, total)
        if not 1 <= bounds[0] <= bounds[1] <= total:
            raise InputError(
                f"{self.key}={self.text!r}: there are {total} {things}; expected from 1 to "
                f"{total}, in a range the smaller number first"
            )
        return int(rng.integers(bounds[0], bounds[1] + 1))

    def choose(self, total: int, rng: np.random.Generator, things: str) -> list[int]:
        """Which of `total` things, drawn at random; in their order."""
        count = self.draw(total, rng, things)
        return sorted(rng.choice(total, size=count, replace=False).tolist())


def _count(text: str, total: int) -> int:
    if text == "all":
        return total
    if text.endswith("%"):
        return max(1, int(float(text[:-1]) / 100 * total + 0.5))
    return int(text)
