"""Improve all the poses at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mvreg.types import Result, View

if TYPE_CHECKING:
    from mvreg.contracts import Pipeline


@dataclass(frozen=True)
class NoAdjust:
    """Leave the poses as they are, as the paper does."""

    def __call__(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        return result
