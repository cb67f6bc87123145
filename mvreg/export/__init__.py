"""What a run has found, in the formats that other programs read; what writers of formats get."""

from mvreg.export.formats import PointFormat, PoseFormat
from mvreg.export.model import Clouds, Model, OwnScan
from mvreg.export.placements import Component, Link, Placements
from mvreg.export.poses.text import stems, write_names

__all__ = [
    "Clouds",
    "Component",
    "Link",
    "Model",
    "OwnScan",
    "Placements",
    "PointFormat",
    "PoseFormat",
    "stems",
    "write_names",
]
