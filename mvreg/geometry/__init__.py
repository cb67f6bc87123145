"""Rigid motions, arrays and nearest neighbours: modules `se3` and `nearest`, types of arrays."""

from mvreg.geometry import se3
from mvreg.geometry.arrays import Array, Flags, Indices

__all__ = ["Array", "Flags", "Indices", "se3"]
