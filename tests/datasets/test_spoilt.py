"""A data set made worse: by as much as was asked for, and the truth stays true."""

import numpy as np
import pytest

import mvreg
from mvreg.datasets.spoilt import MARGIN, Spoilt
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.geometry.nearest import mean_spacing
from mvreg.types import Scan

BLOB = "tiny points=2000 views=3 shape=blob-0 noise=0 quantisation=0"


def spoilt(rng=0, **parameters):
    return mvreg.dataset("spoilt", rng, **{"of": BLOB, **parameters})


@pytest.fixture(scope="module")
def clean():
    return spoilt()


def test_nothing_spoils_nothing(clean):
    plain = mvreg.dataset("tiny", points=2000, views=3, shape="blob-0", noise=0, quantisation=0)
    assert clean.name == "tiny_blob-0_spoilt" and clean.unit == "mm"
    for old, new in zip(plain.scans, clean.scans, strict=True):
        assert old.name == new.name
        np.testing.assert_array_equal(old.points, new.points)
        np.testing.assert_array_equal(plain.poses[old.name], clean.poses[old.name])


def test_noise_is_in_resolutions_along_the_line_of_sight(clean):
    found = spoilt(noise=0.5)
    resolution = np.median([mean_spacing(scan.points) for scan in clean.scans])
    for old, new in zip(clean.scans, found.scans, strict=True):
        error = new.points - old.points
        rays = old.points - old.view_point
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        along = (error * rays).sum(axis=1)
        np.testing.assert_allclose(error, along[:, None] * rays, atol=1e-9)
        assert along.std() == pytest.approx(0.5 * resolution, rel=0.1)
        assert abs(along.mean()) < 0.1 * resolution
    # Of all the scans there is but one noise, as there is but one sensor.
    one, two = found.scans[:2]
    assert (one.points - clean.scans[0].points)[:20].std() != (two.points - clean.scans[1].points)[
        :20
    ].std()


@pytest.mark.parametrize("direction", [None, [0.0, 0.0, 1.0]])
def test_noise_without_a_sensor_is_in_every_direction(direction):
    from mvreg.datasets.spoilt import _errors

    scan = Scan("s", np.random.default_rng(0).normal(size=(4000, 3)), direction)
    deviations = _errors(scan, np.random.default_rng(1)).std(axis=0)
    wanted = [1, 1, 1] if direction is None else direction
    np.testing.assert_allclose(deviations, wanted, atol=0.05)


def test_a_share_of_the_points_are_outliers_in_a_larger_box(clean):
    found = spoilt(outliers=0.2)
    for old, new in zip(clean.scans, found.scans, strict=True):
        known = set(map(tuple, old.points.tolist()))
        true = np.array([tuple(point) in known for point in new.points.tolist()])
        np.testing.assert_array_equal(new.points[true], old.points)  # in their order
        assert (~true).mean() == pytest.approx(0.2, abs=0.001)
        assert true[:400].mean() < 0.95 and true[-400:].mean() > 0.65  # not all at the end
        lower, upper = old.points.min(axis=0), old.points.max(axis=0)
        margin = MARGIN * (upper - lower).max()
        false = new.points[~true]
        assert (false >= lower - margin).all() and (false <= upper + margin).all()
        assert (false.min(axis=0) < lower).any() and (false.max(axis=0) > upper).any()


def test_points_are_dropped_at_random(clean):
    found = spoilt(drop=0.5)
    for old, new in zip(clean.scans, found.scans, strict=True):
        assert len(new.points) == round(0.5 * len(old.points))
        where = [np.flatnonzero((old.points == p).all(axis=1))[0] for p in new.points]
        assert where == sorted(where)
        assert 0.4 < np.mean(np.array(where) < len(old.points) / 2) < 0.6
        assert len(set(np.diff(where))) > 3  # no stride


def test_one_scan_is_thinned_another_each_time(clean):
    which = set()
    for rng in range(6):
        found = spoilt(rng, sparse=1, thin=8)
        shares = np.array([len(new.points) / len(old.points)
                           for old, new in zip(clean.scans, found.scans, strict=True)])  # fmt: skip
        assert (shares == 1).sum() == 2 and shares.min() == pytest.approx(1 / 8, abs=0.01)
        which.add(int(shares.argmin()))
    assert len(which) > 1


def test_all_of_it_together_keeps_the_truth_and_the_sensor(clean):
    one = spoilt(3, noise=0.1, outliers=0.1, drop=0.5, sparse=3, thin=2)
    two = spoilt(3, noise=0.1, outliers=0.1, drop=0.5, sparse=3, thin=2)
    for old, new, again in zip(clean.scans, one.scans, two.scans, strict=True):
        np.testing.assert_array_equal(new.points, again.points)
        assert len(new.points) == pytest.approx(0.5 / 0.9 / 2 * len(old.points), abs=2)
        np.testing.assert_array_equal(new.view_point, old.view_point)
        np.testing.assert_array_equal(one.poses[new.name], clean.poses[new.name])


def test_it_can_be_scrambled_and_shuffled(clean):
    found = spoilt(1, scramble=True, order="shuffle", drop=0.5)
    there = {scan.name: scan for scan in clean.scans}
    for scan in found.scans:
        back = se3.invert(clean.poses[scan.name]) @ found.poses[scan.name]
        distances, _ = there[scan.name].tree.query(se3.apply(back, scan.points))
        assert distances.max() < 1e-9


def test_a_mixture_is_spoilt_object_by_object():
    found = spoilt(of="mixture of=['tiny points=300 views=2 shape=sphere','tiny points=300 "
                   "views=2 shape=blob-0'] keep=[2,1]", drop=0.5)  # fmt: skip
    assert found.name == "tiny_sphere+tiny_blob-0_spoilt"
    assert sorted(found.objects.values()) == ["tiny_blob-0", "tiny_sphere", "tiny_sphere"]
    assert all(len(scan.points) < 200 for scan in found.scans)


def test_few_points_stay_points():
    found = spoilt(drop=0.999, sparse=3, thin=1e6, noise=1.0, outliers=0.5)
    assert [len(scan.points) for scan in found.scans] == [1, 1, 1]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"of": ""}, "needs the data set to be spoilt: dataset.of=bunny"),
        ({"of": "tinny"}, "dataset.of='tinny': dataset=tinny is not registered"),
        ({"noise": -0.1}, "dataset.noise=-0.1: expected a number, 0 or more"),
        ({"noise": float("nan")}, "dataset.noise=nan"),
        ({"outliers": 1.0}, "from 0 to less than 1"),
        ({"drop": 1.0}, "from 0 to less than 1"),
        ({"sparse": -1}, "dataset.sparse=-1"),
        ({"sparse": 4}, "expected at most 3"),
        ({"thin": 0.5}, "dataset.thin=0.5: expected a number, 1 or more"),
    ],
)
def test_what_cannot_be_spoilt_is_refused(changes, said):
    with pytest.raises(InputError) as caught:
        Spoilt(**{"of": BLOB, **changes})(np.random.default_rng(0))
    assert said in str(caught.value)
