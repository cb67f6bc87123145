"""The covariances of a joint refinement where the truth is known: a linear problem of one pose."""

import numpy as np
import pytest

from mvreg.stages.adjust.joint.correspondences import Contacts
from mvreg.stages.adjust.joint.covariance import covariances
from mvreg.stages.adjust.joint.normal_equations import Frame, Rows, System, weight
from mvreg.types import Array

#: The frame of the unknowns: none of its own.
FRAME = Frame(np.zeros(3), 1.0)
NOISE = 0.01


def rows(jacobian: Array, residuals: Array) -> Rows:
    """Residuals of scan 1 to scan 0, which is held, each in a cell of its own."""
    count = len(residuals)
    some = np.arange(count)
    one = Contacts(np.array([[1, 0]]), np.array([0, count]), some, some, np.ones(count))
    points = 10.0 * np.column_stack([some, np.zeros((count, 2))])
    ones = np.ones(count)
    return Rows(one, residuals, jacobian, points, np.zeros(count), ones)


def estimated(jacobian: Array, noise: Array, width: float) -> tuple[Array, Array]:
    """The unknowns (6,) of noisy data, whose truth is zero, and what is said of their scatter."""
    unknowns = np.zeros(6)
    for _ in range(60):
        residuals = noise + jacobian @ unknowns
        weighted = jacobian * weight(residuals, width)[:, None]
        unknowns = -np.linalg.lstsq(weighted.T @ jacobian, weighted.T @ noise, rcond=None)[0]
    found = rows(jacobian, noise + jacobian @ unknowns)
    return unknowns, covariances(found, System.of(found, [1], width), FRAME, width, 1.0)[0]


@pytest.mark.parametrize(
    ("count", "width", "within"),
    [
        pytest.param(12, 1e3 * NOISE, 0.15, id="as many unknowns as spare residuals"),
        pytest.param(396, 2 * NOISE, 0.15, id="a kernel that is not much wider than the noise"),
    ],
)
def test_the_size_of_the_covariance_is_that_of_the_scatter(count, width, within):
    """In units of the true covariance, by its trace."""
    rng = np.random.default_rng(0)
    jacobian = np.tile(np.eye(6), (count // 6, 1))
    draws = [estimated(jacobian, NOISE * rng.normal(size=count), width) for _ in range(300)]
    scatter = np.cov(np.stack([unknowns for unknowns, _ in draws]).T)
    told = np.mean([covariance for _, covariance in draws], axis=0)
    assert abs(np.trace(told) / np.trace(scatter) - 1) < within
