from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.kernels import trimmed_pairs
from mvreg.stages.refine.trimmed import ICP, FractionalICP, TrimmedICP
from mvreg.testing import blob_views, overlap
from mvreg.testing.reference.icp import trim
from mvreg.testing.refine import nudge

quick = settings(max_examples=60, deadline=None)
rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)
shares = st.sampled_from([0.01, 0.25, 0.4, 0.5, 0.77, 1.0])
exponents = st.sampled_from([0.0, 1.0, 2.0, 3.0])


def psi(squares, size, exponent):
    """Eq. (4), written out."""
    return np.mean(squares) / (len(squares) / size) ** (1 + exponent)


@quick
@given(rngs, st.integers(1, 9), shares, exponents)
def test_trimming_is_the_best_of_all_subsets(rng, size, share, exponent):
    distances = np.sort(rng.uniform(size=size) ** rng.integers(1, 5))
    keep, objective = trim(distances, share, 1 + exponent)
    least = max(int(np.ceil(share * size)), 1)
    subsets = (s for k in range(least, size + 1) for s in combinations(distances**2, k))
    assert least <= keep <= size
    assert objective == pytest.approx(min(psi(s, size, exponent) for s in subsets))
    assert objective == pytest.approx(psi(distances[:keep] ** 2, size, exponent))


def test_trimming_by_hand():
    keep, objective = trim(np.array([1.0, 1.0, 1.0, 10.0]), 0.4, 3.0)
    assert keep == 3
    assert objective == pytest.approx(1 / 0.75**3)
    assert trim(np.array([1.0, 1.0, 1.0, 1.1]), 0.4, 3.0)[0] == 4
    assert trim(np.array([0.0, 9.0]), 0.5, 3.0) == (1, 0.0)
    assert trim(np.zeros(3), 0.1, 3.0)[1] == 0.0


@quick
@given(rngs, shares, exponents, st.sampled_from([1e-3, 0.1, 1.0, 30.0, 1e4]))
def test_a_bound_does_not_change_the_pairs(rng, share, exponent, bound):
    pair = overlap()
    points = pair.source.points[rng.permutation(len(pair.source.points))[:60]]
    moved = se3.apply(pair.T_target_source @ nudge(pair.source, 5 * rng.random(), 3), points)
    free = trimmed_pairs.trimmed(pair.target.tree, moved, np.inf, share, exponent)
    bounded = trimmed_pairs.trimmed(pair.target.tree, moved, bound, share, exponent)
    for one, other in zip(bounded[:4], free[:4], strict=True):
        np.testing.assert_array_equal(one, other)
    chosen, targets = free[:2]
    table = np.linalg.norm(moved[:, None] - pair.target.points[None], axis=2)
    np.testing.assert_array_equal(targets, table.argmin(axis=1)[chosen])
    assert list(chosen) == list(np.argsort(table.min(axis=1))[: len(chosen)])


@pytest.mark.parametrize(
    "stage",
    [TrimmedICP(), TrimmedICP(min_overlap=0.2, exponent=1.0), ICP(), FractionalICP()],
)
@pytest.mark.parametrize("start", [(3.0, 1.0), (20.0, 4.0), (120.0, 10.0)])
def test_the_objective_never_grows(stage, start):
    """Pairs, overlap and motion are each solved exactly, so no iteration makes it worse."""
    pair = overlap()
    begin = pair.T_target_source @ nudge(pair.source, *start)
    most = range(1, 16)
    runs = [replace(stage, max_iterations=n)(pair.source, pair.target, begin) for n in most]
    objectives = [run.objective for run in runs]
    assert [run.iterations for run in runs][:3] == [1, 2, 3]
    assert objectives[1] < objectives[0]
    np.testing.assert_array_less(np.diff(objectives), 1e-12 * objectives[0])


def test_one_iteration_is_one_fit_to_the_trimmed_pairs():
    pair = overlap()
    begin = pair.T_target_source @ nudge(pair.source, 5.0, 2.0)
    moved = se3.apply(begin, pair.source.points)
    chosen, targets, *_ = trimmed_pairs.trimmed(pair.target.tree, moved, np.inf, 0.4, 3.0)
    fitted = se3.fit(pair.source.points[chosen], pair.target.points[targets])
    found = TrimmedICP(max_iterations=1)(pair.source, pair.target, begin)
    np.testing.assert_allclose(found.T_target_source, fitted, atol=1e-12)
    assert (found.iterations, found.converged) == (1, False)


def test_it_converges_and_says_so():
    pair = overlap()
    begin = pair.T_target_source @ nudge(pair.source, 2.0, 1.0)
    found = TrimmedICP()(pair.source, pair.target, begin)
    assert found.converged
    assert 1 < found.iterations < 100
    hasty = TrimmedICP(tolerance=0.1)(pair.source, pair.target, begin)
    assert hasty.iterations < found.iterations
    assert hasty.objective >= found.objective


def test_the_overlap_is_found():
    """Neighbours 40 degrees apart share four fifths of their points, the others half."""
    views = blob_views(3)
    pair = overlap()
    near = TrimmedICP()(pair.source, pair.target, pair.T_target_source)
    assert 0.65 < near.overlap < 0.9
    half = pair.target.points[:, 2] < np.median(pair.target.points[:, 2])
    part = replace(pair.target, points=pair.target.points[half], normals=pair.target.normals[half])
    cut = TrimmedICP(min_overlap=0.1)(pair.source, part, pair.T_target_source)
    assert cut.overlap < near.overlap - 0.1
    assert len(views) == 3


def test_plain_icp_counts_every_point():
    pair = overlap()
    found = ICP()(pair.source, pair.target, pair.T_target_source)
    assert found.overlap == 1.0
    assert len(found.pairs) == len(pair.source.points)
    assert found.objective == pytest.approx(found.trimmed_mse)
    trimmed = TrimmedICP()(pair.source, pair.target, pair.T_target_source)

    def off(registration):
        gaps = registration.T_target_source - pair.T_target_source
        return np.linalg.norm(gaps[:3, :3])

    assert off(found) > 2 * off(trimmed), "partial overlap biases it"


@pytest.mark.parametrize("share", [0.0, -0.1, 1.01])
def test_a_share_is_a_share(share):
    with pytest.raises(InputError, match=r"refine\.min_overlap: expected a share in \(0, 1\]"):
        TrimmedICP(min_overlap=share)


@quick
@given(rngs, st.integers(1, 8), st.sampled_from([0.95, 1.3, 3.0]))
def test_the_fractional_rmsd_is_least_of_all_subsets(rng, size, exponent):
    """FRMSD as its authors write it, over every subset, against what the stage reports."""
    pair = overlap()
    chosen = rng.choice(len(pair.source.points), size, replace=False)
    few = replace(
        pair.source, points=pair.source.points[chosen], normals=pair.source.normals[chosen]
    )
    begin = pair.T_target_source @ nudge(pair.source, 4 * rng.random(), 3)
    stage = FractionalICP(exponent=exponent, min_overlap=0.01, max_iterations=0)
    found = stage(few, pair.target, begin)
    moved = se3.apply(begin, few.points)
    table = np.linalg.norm(moved[:, None] - pair.target.points[None], axis=2).min(axis=1)
    subsets = (s for k in range(1, size + 1) for s in combinations(table, k))
    frmsd = {s: np.sqrt(np.mean(np.square(s))) / (len(s) / size) ** exponent for s in subsets}
    best = min(frmsd, key=frmsd.get)
    assert np.sqrt(found.objective) == pytest.approx(frmsd[best])
    np.testing.assert_allclose(found.distances, sorted(best))


def test_fractional_icp_is_tricp_with_another_exponent():
    """Phillips' 1.5 is the paper's 2: a square root changes no minimum."""
    pair = overlap()
    begin = pair.T_target_source @ nudge(pair.source, 3.0, 1.0)
    fractional = FractionalICP(exponent=1.5)(pair.source, pair.target, begin)
    trimmed = TrimmedICP(exponent=2.0)(pair.source, pair.target, begin)
    np.testing.assert_array_equal(fractional.T_target_source, trimmed.T_target_source)
    assert fractional.objective == trimmed.objective
    assert FractionalICP()(pair.source, pair.target, begin).overlap < trimmed.overlap
