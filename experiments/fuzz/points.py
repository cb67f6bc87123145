"""The points and faces that the files to be damaged hold."""

from __future__ import annotations

import numpy as np

from mvreg.types import Array

POINTS = np.random.default_rng(0).normal(size=(40, 3)).round(3)
FACES = np.random.default_rng(1).integers(0, 40, (20, 3))


def rows(more: str = "", points: Array = POINTS) -> str:
    return "".join(f"{x} {y} {z}{more}\n" for x, y, z in points.tolist())
