"""What the micro-benchmarks work on: two neighbouring scans of the figurine, of the usual size.

    python -m pytest experiments/micro --benchmark-only
    python -m pytest experiments/micro --benchmark-only --benchmark-autosave --benchmark-compare

``make test`` does not run them. A function and its reference are variants of one group.
"""

from __future__ import annotations

import numpy as np
import pytest

import mvreg
from mvreg.geometry import se3
from mvreg.run import load_method
from mvreg.types import Array, Matches, Scan, ScanSet, View


@pytest.fixture(scope="session")
def scans() -> ScanSet:
    """Two scans of 30,000 points, 40 degrees apart."""
    return mvreg.dataset("figurine", views=2)


@pytest.fixture(scope="session")
def scan(scans: ScanSet) -> Scan:
    """One of them."""
    return scans.scans[0]


@pytest.fixture(scope="session")
def views(scans: ScanSet) -> list[View]:
    """Both, prepared by the default method."""
    return load_method().pipeline.prepare(scans.scans, np.random.default_rng(0))


@pytest.fixture(scope="session")
def truth(scans: ScanSet) -> Array:
    """``T_target_source`` (4, 4) of the first scan to the second."""
    poses = scans.poses or {}
    source, target = (each.name for each in scans.scans)
    found: Array = se3.invert(poses[target]) @ poses[source]
    return found


@pytest.fixture(scope="session")
def seeds(views: list[View]) -> Matches:
    """Seed matches of the first view to the second."""
    found: Matches = load_method().pipeline.seed(*views)
    return found
