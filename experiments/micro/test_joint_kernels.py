"""Speed of the joint refinement's kernels, each beside its reference in plain NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from experiments.micro.test_kernels import BOTH, FEW, timed
from mvreg.kernels import contacts, fit, normal_equations
from mvreg.stages.adjust.joint.surface import Surface, surfaces
from mvreg.testing.reference import fit as plain_fit
from mvreg.testing.reference import joint as plain
from mvreg.types import Array, Scan, View

#: Of the samples, every so many; raw points of a patch, and what keeps its equations solvable.
STRIDE, COUNT, RIDGE = 4, 30, 1e-6
#: Whether the normals of both scans have signs.
ORIENTED = np.array([True, True])
#: Of the normal equations.
RESIDUALS, WIDTH = 20_000, 0.3


@pytest.fixture(scope="module")
def pair(views: list[View]) -> list[Surface]:
    """The patches of both scans."""
    return surfaces(views)


def plainly(surface: Surface) -> plain.Patches:
    """A surface as the reference asks for it."""
    return plain.Patches(*surface.patches.arrays())


@BOTH
@pytest.mark.benchmark(group="kernel: contacts of a pair, one sample in 4")
def test_contacts(
    benchmark: Any, pair: list[Surface], views: list[View], truth: Array, variant: str
) -> None:
    source, target = pair
    reach, plain_source, plain_target = 3 * views[0].resolution, plainly(source), plainly(target)
    given = np.stack([truth, np.eye(4)]), np.array([[0, 1]]), reach, STRIDE, False, 0.7, ORIENTED
    found = timed(
        benchmark, variant, lambda: contacts.contacts([source.patches, target.patches], *given),
        lambda: plain.contacts([plain_source, plain_target], *given),
    )  # fmt: skip
    assert len(found[1]) > 20


@BOTH
@pytest.mark.benchmark(group="kernel: fit 20 patches")
def test_fit(benchmark: Any, scan: Scan, pair: list[Surface], variant: str) -> None:
    surface, tree = pair[0], scan.tree
    some = surface.points[:FEW], surface.patches.arrays()[1][:FEW], COUNT, RIDGE
    found = timed(
        benchmark, variant, lambda: fit.fit(tree, *some), lambda: plain_fit.fit(scan.points, *some)
    )
    assert np.isfinite(found[1]).all()


@BOTH
@pytest.mark.benchmark(group="kernel: normal equations of 20,000 residuals")
def test_equations(benchmark: Any, variant: str) -> None:
    rng = np.random.default_rng(0)
    given = (rng.normal(size=(RESIDUALS, 6)), 0.1 * rng.normal(size=RESIDUALS),
             np.ones(RESIDUALS), np.array([0, RESIDUALS]), WIDTH)  # fmt: skip
    (matrix,), _ = timed(
        benchmark, variant, lambda: normal_equations.normal_equations(*given),
        lambda: plain.normal_equations(*given),
    )  # fmt: skip
    assert np.linalg.eigvalsh(matrix).min() > 0
