"""The records that pass between the stages.

All are frozen. Lengths are in the unit of the scans, which no stage needs to know; transforms are
4x4, ``x_target = T_target_source @ x_source``. Arrays are float64 and must not be written to.
"""

from __future__ import annotations

from mvreg.geometry.arrays import Array, Indices
from mvreg.types.given import Scans
from mvreg.types.inputs import Finding, Input
from mvreg.types.pointlike import PointLike
from mvreg.types.records import Candidates, Matches, Registration, Verdict
from mvreg.types.results import Answer, Link, Pair, Result
from mvreg.types.scan import Scan, ScanSet
from mvreg.types.scatter import Pattern, PoseScatter, ScanScale
from mvreg.types.view import (
    Features,
    Model,
    Part,
    Sample,
    Scale,
    View,
    common_spread,
    estimated_spread,
)
from mvreg.types.view_graph import Edge, Loop, ViewGraph

__all__ = [
    "Answer",
    "Array",
    "Candidates",
    "Edge",
    "Features",
    "Finding",
    "Indices",
    "Input",
    "Link",
    "Loop",
    "Matches",
    "Model",
    "Pair",
    "Part",
    "Pattern",
    "PointLike",
    "PoseScatter",
    "Registration",
    "Result",
    "Sample",
    "Scale",
    "Scan",
    "ScanScale",
    "ScanSet",
    "Scans",
    "Verdict",
    "View",
    "ViewGraph",
    "common_spread",
    "estimated_spread",
]
