"""Leave the poses as they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from mvreg.contracts import Pipeline
from mvreg.types import Result, View


@dataclass(frozen=True)
class NoAdjust:
    """Leave the poses as they are, as the paper does."""

    holds_fixed: ClassVar[bool] = True

    def __call__(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        return result
