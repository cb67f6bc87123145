"""Scans of several objects thrown together: which there are, and what is true of them."""

import numpy as np
import pytest

import mvreg
from mvreg.datasets.amount import Amount
from mvreg.datasets.base import Order
from mvreg.datasets.mixture import Mixture, join
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.types import Scan, ScanSet

SMALL = "points=300 views=3"
ROUND, BLOB = f"tiny {SMALL} shape=sphere", f"tiny {SMALL} shape=blob-0"


def mixed(rng=0, **parameters):
    return mvreg.dataset("mixture", rng, **{"of": [ROUND, BLOB], **parameters})


def some(name, names, unit="mm", poses=True, objects=None):
    scans = tuple(Scan(each, np.eye(3)) for each in names)
    truth = dict.fromkeys(names, np.eye(4)) if poses else None
    return ScanSet(name, scans, unit, truth, objects)


def test_every_scan_of_every_set_is_there_with_its_object():
    found = mixed()
    assert found.name == "tiny_sphere+tiny_blob-0" and found.unit == "mm"
    assert len(found.scans) == 6 and set(found.objects) == set(found.poses)
    for scan in found.scans:
        assert scan.name.startswith(f"{found.objects[scan.name]}_0")


def test_the_scans_are_shuffled_and_moved_and_the_truth_follows():
    given = mixed(order="given", scramble=False)
    assert [s.name for s in given.scans] == [
        *(f"tiny_sphere_{i:02d}" for i in range(3)), *(f"tiny_blob-0_{i:02d}" for i in range(3)),
    ]  # fmt: skip
    before, orders = {scan.name: scan for scan in given.scans}, set()
    for rng in range(3):
        found = mixed(rng)
        orders.add(tuple(scan.name for scan in found.scans))
        for scan in found.scans:
            old = before[scan.name]
            assert np.abs(scan.points - old.points).max() > 1
            np.testing.assert_allclose(
                se3.apply(found.poses[scan.name], scan.points),
                se3.apply(given.poses[scan.name], old.points), atol=1e-9,
            )  # fmt: skip
    assert len(orders) == 3
    assert Mixture().order is Order.shuffle and Mixture().scramble


def test_the_same_number_draws_the_same():
    one, two, other = (mixed(rng, keep=["2"]) for rng in (5, 5, 6))
    assert [scan.name for scan in one.scans] == [scan.name for scan in two.scans]
    for a, b in zip(one.scans, two.scans, strict=True):
        np.testing.assert_array_equal(a.points, b.points)
    assert any(
        a.name != b.name or (a.points != b.points).any()
        for a, b in zip(one.scans, other.scans, strict=True)
    )


def test_truth_beside_a_scan_is_of_its_object_alone():
    found = mixed()
    beside = found.truth_beside("tiny_blob-0_01")
    assert set(beside) == {f"tiny_blob-0_{i:02d}" for i in range(3)}
    alone = some("x", "ab")
    assert alone.truth_beside("a") is alone.poses
    assert some("x", "ab", poses=False).truth_beside("a") is None


@pytest.mark.parametrize(
    ("keep", "spheres", "blobs"),
    [(["all"], 3, 3), (["2"], 2, 2), (["all", "1"], 3, 1), (["34%", "50%"], 1, 2),
     (["1%", "100%"], 1, 3)],
)  # fmt: skip
def test_some_of_the_scans_are_kept(keep, spheres, blobs):
    found = mixed(keep=keep)
    shown = list(found.objects.values())
    assert (shown.count("tiny_sphere"), shown.count("tiny_blob-0")) == (spheres, blobs)
    assert set(found.objects) == set(found.poses) == {scan.name for scan in found.scans}


def test_ranges_draw_every_number_and_every_scan():
    rng = np.random.default_rng(0)
    draws = [Amount("key", "2-4").choose(5, rng, "things") for _ in range(300)]
    sizes = [len(draw) for draw in draws]
    assert set(sizes) == {2, 3, 4} and all(sizes.count(n) > 70 for n in (2, 3, 4))
    assert {each for draw in draws for each in draw} == set(range(5))
    assert all(draw == sorted(set(draw)) for draw in draws)
    assert {Amount("key", "50%-all").draw(4, rng, "things") for _ in range(50)} == {2, 3, 4}
    assert Amount("key", "50%").draw(15, rng, "things") == 8


def test_sets_are_drawn():
    found = [mixed(rng, choose="1-2", keep=["2"]).name for rng in (0, 1, 11)]
    assert set(found) == {"tiny_sphere", "tiny_blob-0", "tiny_sphere+tiny_blob-0"}


def test_one_set_alone_may_be_thinned_out():
    found = mixed(of=[BLOB], keep=["50%"])
    assert len(found.scans) == 2 and set(found.objects.values()) == {"tiny_blob-0"}


def test_objects_keep_their_names_and_never_become_one():
    inner = some("pair", "ab", objects={"a": "one", "b": "two"})
    other = some("one", "c")
    found = join([inner, other, some("dark", "d", poses=False)])
    assert found.objects == {"a": "one", "b": "two", "c": "one_2", "d": "dark"}
    assert set(found.poses) == set("abc") and found.name == "pair+one+dark"
    assert join([some("x", "ab", poses=False)]).poses is None


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"of": []}, "needs the data sets to be mixed"),
        ({"of": ["tinny"]}, "dataset.of='tinny': dataset=tinny is not registered; options"),
        ({"of": ["tiny wide=3"]}, "dataset.wide does not exist; parameters of dataset=tiny"),
        ({"of": [""]}, "expected the name of a data set"),
        ({"of": ["shape=sphere"]}, "expected the name of a data set"),
        ({"of": [ROUND, ROUND]}, "tiny_sphere_00, tiny_sphere_01, tiny_sphere_02 twice"),
        ({"keep": ["1", "1", "1"]}, "one for each of the 2 sets"),
        ({"keep": ["some"]}, "dataset.keep='some': expected all, a number"),
        ({"keep": ["120%"]}, "expected all, a number"),
        ({"keep": ["3", "4"]}, "dataset.keep='4': there are 3 scans of 'tiny"),
        ({"keep": ["2-1"]}, "the smaller number first"),
        ({"keep": ["0"]}, "from 1 to 3"),
        ({"choose": "3"}, "dataset.choose='3': there are 2 sets"),
        ({"choose": "1", "keep": ["1"]}, "expected at least 2 scans, drew 1"),
        ({"order": "sorted"}, "order"),
    ],
)  # fmt: skip
def test_what_cannot_be_mixed_is_refused(changes, said):
    with pytest.raises(InputError) as caught:
        mixed(**changes)
    assert said in str(caught.value)


def test_units_are_not_mixed():
    with pytest.raises(InputError, match="one unit of length, got x in mm, y in m"):
        join([some("x", "ab"), some("y", "cd", unit="m")])


def test_real_scans_are_mixed(data_root):
    found = mvreg.dataset("mixture", 0, of=["bunny", "dragon"], keep=["all", "1"])
    shown = list(found.objects.values())
    assert (shown.count("bunny"), shown.count("dragon"), found.unit) == (10, 1, "mm")
    # Side by side in the frame of their object, the Bunny's scans lie on each other.
    bunny = [scan for scan in found.scans if found.objects[scan.name] == "bunny"]
    moved = [se3.apply(found.poses[scan.name], scan.points) for scan in bunny]
    lower, upper = np.min([p.min(axis=0) for p in moved], 0), np.max([p.max(0) for p in moved], 0)
    assert (upper - lower).max() < 200


def test_the_command_line_mixes(tmp_path, monkeypatch):
    from mvreg.cli.main import main
    from mvreg.report.json_file import load_report

    monkeypatch.chdir(tmp_path)
    code = main(["dataset=mixture", "rerun=false", "hydra.run.dir=out",
                 f"dataset.of=['{ROUND}','tiny {SMALL}']", "dataset.keep=[2,50%]"])  # fmt: skip
    assert code in (0, 3)
    report = load_report(tmp_path / "out")
    assert report["dataset"] == "tiny_sphere+tiny" and len(report["scans"]) == 4
