"""The covariances of a joint refinement where the truth is known: linear problems."""

import numpy as np
import pytest

from mvreg.geometry import se3
from mvreg.stages.adjust.joint import covariance as covariance_module
from mvreg.stages.adjust.joint.clusters import Cells, Clusters
from mvreg.stages.adjust.joint.correspondences import Contacts
from mvreg.stages.adjust.joint.covariance import (
    cell_variance,
    classes,
    covariance_blocks,
    pose_scatter,
    relative_covariance,
)
from mvreg.stages.adjust.joint.frame import Frame
from mvreg.stages.adjust.joint.normal_equations import System, weight
from mvreg.stages.adjust.joint.rows import Rows
from mvreg.types import Array, PoseScatter

#: The frame of the unknowns: none of its own.
FRAME = Frame(np.zeros(3), 1.0)
NOISE = 0.01
#: A kernel so wide is least squares.
WIDE = 1e3
#: Scans in a ring with one more link across; the first is held.
RING = np.array([[1, 0], [2, 1], [3, 2], [3, 0], [3, 1]])
EACH = 60


def rows(ways: Array, jacobian: Array, residuals: Array, each_in_a_cell: float = 10.0) -> Rows:
    """As many residuals for each way, each in a cell of its own."""
    count = len(residuals)
    some, ends = np.arange(count), np.linspace(0, count, len(ways) + 1).astype(np.intp)
    one = Contacts(np.array(ways), ends, some, some, np.ones(count))
    points = each_in_a_cell * np.column_stack([some, np.zeros((count, 2))])
    return Rows(one, residuals, jacobian, points, np.zeros(count), np.ones(count))


def told(found: Rows, free: list[int], width: float = WIDE, graded=()) -> PoseScatter:
    system = System.of(found, free, width)
    names = [f"scan {k}" for k in free], ["scan 0"]
    variance = cell_variance(found, system, width, 1.0)
    return pose_scatter(found, system, system.normal, FRAME, width, variance, graded, names)


def estimated(jacobian: Array, noise: Array, width: float) -> tuple[Array, Array]:
    """The unknowns (6,) of noisy data, whose truth is zero, and what is said of their scatter."""
    unknowns = np.zeros(6)
    for _ in range(60):
        residuals = noise + jacobian @ unknowns
        weighted = jacobian * weight(residuals, width)[:, None]
        unknowns = -np.linalg.lstsq(weighted.T @ jacobian, weighted.T @ noise, rcond=None)[0]
    found = rows([[1, 0]], jacobian, noise + jacobian @ unknowns)
    return unknowns, covariance_blocks(told(found, [1], width))[0, 0]


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
    draws = [estimated(jacobian, NOISE * rng.normal(size=count), width) for _ in range(200)]
    scatter = np.cov(np.stack([unknowns for unknowns, _ in draws]).T)
    told_ = np.mean([covariance for _, covariance in draws], axis=0)
    assert abs(np.trace(told_) / np.trace(scatter) - 1) < within


def ring(rng: np.random.Generator, noise: Array, graded=()) -> tuple[Array, PoseScatter]:
    """Errors (3, 6) of the free scans of the ring, whose true poses are the identity."""
    jacobian = 0.7 + np.random.default_rng(5).normal(size=(len(RING) * EACH, 6))
    design = np.zeros((len(jacobian), 4, 6))
    for number, (source, target) in enumerate(RING):
        mine = slice(number * EACH, (number + 1) * EACH)
        design[mine, source] += jacobian[mine]
        design[mine, target] -= jacobian[mine]
    design = design[:, 1:].reshape(len(design), -1)
    unknowns = -np.linalg.lstsq(design, noise, rcond=None)[0]
    found = rows(RING, jacobian, noise + design @ unknowns)
    return unknowns.reshape(3, 6), told(found, [1, 2, 3], graded=graded)


def normalised(errors: Array, covariance: Array) -> float:
    return float(errors @ np.linalg.solve(covariance, errors))


def test_squared_errors_of_poses_and_of_pairs_are_those_of_a_chi_square():
    """Six unknowns: 6 in the mean, and the quantiles; of linked pairs and of others."""
    rng = np.random.default_rng(1)
    single, linked, other = [], [], []
    for _ in range(150):
        errors, scatter = ring(rng, NOISE * rng.normal(size=len(RING) * EACH))
        blocks = covariance_blocks(scatter)
        single += [normalised(errors[k], blocks[k, k]) for k in range(3)]
        linked.append(normalised(errors[1] - errors[0], blocks.relative(1, 0, np.eye(4))))
        apart = relative_covariance(scatter, "scan 2", "scan 0", np.eye(4))
        other.append(normalised(errors[1], apart))
    for found in (single, linked, other):
        assert np.mean(found) == pytest.approx(6, abs=0.7)
        # Of a chi-square with six degrees of freedom.
        for quantile, share in ((2.204, 0.10), (5.348, 0.5), (10.645, 0.9), (12.592, 0.95)):
            assert np.mean(np.less(found, quantile)) == pytest.approx(share, abs=0.08)


def test_what_a_class_gets_wrong_is_in_the_covariance():
    """A bias of one class of residuals, in all scans alike, besides the noise."""
    rng = np.random.default_rng(2)
    groups = np.arange(len(RING) * EACH) % 4
    plain, graded = [], []
    for _ in range(60):
        noise = NOISE * rng.normal(size=len(groups))
        noise += np.where(groups == 0, 3 * NOISE * rng.normal(), 0.0)
        for found, classed in ((plain, ()), (graded, (lambda tile: tile.contacts.samples % 4,))):
            errors, scatter = ring(rng, noise, classed)
            blocks = covariance_blocks(scatter)
            found += [normalised(errors[k], blocks[k, k]) for k in range(3)]
    assert np.mean(plain) > 7
    assert np.mean(graded) < 0.75 * np.mean(plain)
    assert np.mean(np.less(graded, 12.592)) > 0.93


def test_relative_to_what_is_held_is_what_the_pose_itself_has(rng):
    _, scatter = ring(rng, NOISE * rng.normal(size=len(RING) * EACH))
    blocks, motion = covariance_blocks(scatter), se3.random(rng, 3.0)
    own = blocks[2, 2]
    np.testing.assert_allclose(blocks.relative(2, -1, np.eye(4)), own)
    np.testing.assert_allclose(relative_covariance(scatter, "scan 3", "scan 0", np.eye(4)), own)
    change = se3.adjoint(se3.invert(motion))
    np.testing.assert_allclose(blocks.relative(2, -1, motion), change @ own @ change.T)
    # Seen from the other scan it is as large.
    there, back = blocks.relative(2, 1, np.eye(4)), blocks.relative(1, 2, np.eye(4))
    np.testing.assert_allclose(there, back)


def test_many_poses_give_the_same_blocks_as_few(rng, monkeypatch):
    """Selected inversion against the whole inverse, and against single columns."""
    classed = (lambda tile: tile.contacts.samples % 3,)
    _, scatter = ring(rng, NOISE * rng.normal(size=len(RING) * EACH), classed)
    few = covariance_blocks(scatter)
    monkeypatch.setattr(covariance_module, "DENSE", 0)
    many = covariance_blocks(scatter)
    for i, j in scatter.places.tolist():
        np.testing.assert_allclose(many[i, j], few[i, j], rtol=1e-7, atol=1e-12)
        one, other = scatter.names[i], scatter.names[j]
        if i != j:
            expected = few.relative(i, j, np.eye(4))
            found = relative_covariance(scatter, one, other, np.eye(4))
            np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-12)


def test_few_cells_are_made_smaller(rng):
    """One cell has a sum of zero at the optimum, and tells nothing."""
    jacobian = rng.normal(size=(600, 6))
    noise = rng.normal(size=600)
    unknowns = -np.linalg.lstsq(jacobian, noise, rcond=None)[0]
    found = rows([[1, 0]], jacobian, noise + jacobian @ unknowns, each_in_a_cell=0.01)
    system = System.of(found, [1], WIDE)
    whole = Clusters.of(found, system, Cells.about(found, 10.0), WIDE)
    assert whole.count == 1 and whole.lost == pytest.approx(1)
    assert cell_variance(found, system, WIDE, 4.0) == pytest.approx(1, rel=0.6)


def test_classes_have_as_many_in_each(rng):
    values = rng.permutation(100).astype(float)
    assert np.bincount(classes(values, 4)).tolist() == [25, 25, 25, 25]
    assert classes(np.ones(9)).max() == 0
