"""`mvreg.register` and its relatives, as a notebook uses them."""

from importlib import resources
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hypothesis import given, settings
from hypothesis import strategies as st
from small_scans import CHANGES, placed_like, poor_scans, three

import mvreg
from mvreg import events
from mvreg.config.compose import compose
from mvreg.config.overrides import spelled
from mvreg.plugins.manager import ObserverWarning
from mvreg.run import method_from
from mvreg.testing import blob_scans, plane_scans
from mvreg.testing.compare import digest
from mvreg.types import Scan

METHODS = ["auto", "ocpra", "ocpma", "fcpma"]


@pytest.fixture(scope="module")
def method():
    return mvreg.load_method("fcpma", CHANGES)


@pytest.fixture(scope="module")
def result(method):
    return mvreg.register(three(), method)


def test_scans_are_placed_where_they_belong(result):
    scans = three()
    assert result.reference == scans.scans[0].name
    assert list(result.poses) == [scan.name for scan in scans.scans]
    assert result.unregistered == ()
    assert placed_like(result, scans, scans.poses) < 3.0, "mm; points are 1.8 mm apart"


@pytest.mark.parametrize(
    "given_as",
    [
        lambda scans: list(scans.scans),
        lambda scans: scans.scans,
        lambda scans: [scan.points for scan in scans.scans],
        lambda scans: [scan.points.tolist() for scan in scans.scans],
        lambda scans: [scans.scans[0], scans.scans[1].points, scans.scans[2]],
        lambda scans: np.stack([scan.points[:3148] for scan in scans.scans]),
    ],
    ids=["list", "tuple", "arrays", "lists", "mixed", "one array"],
)
def test_scans_come_as_they_are_at_hand(given_as, method):
    scans = three()
    found = mvreg.register(given_as(scans), method)
    assert found.unregistered == ()
    truth = {f"scan_{index:03d}": scans.poses[scan.name] for index, scan in
             enumerate(scans.scans)} | scans.poses  # fmt: skip
    named = SimpleNamespace(scans=[Scan(name, scan.points) for name, scan in
                                   zip(found.poses, scans.scans, strict=True)])  # fmt: skip
    assert placed_like(found, named, truth) < 3.0


def test_single_precision_and_whole_numbers_are_fine(method):
    for dtype in (np.float32, np.int16):
        rounded = [(scan.points * 10).astype(dtype) for scan in three().scans]
        assert mvreg.register(rounded, method).unregistered == ()


def test_the_same_call_gives_the_same_answer(method, result):
    np.random.seed(3)  # noqa: NPY002 the global numbers must not matter
    again = mvreg.register(three(), method)
    assert digest(again.poses) == digest(result.poses)
    by_name = mvreg.register(three(), "fcpma", changes=CHANGES)
    assert digest(by_name.poses) == digest(result.poses)
    other = mvreg.register(three(), method, rng=1)
    assert digest(other.poses) != digest(result.poses)
    assert placed_like(other, three(), three().poses) < 3.0


def test_the_scans_stay_as_they_were(method):
    scans = [Scan(scan.name, scan.points.copy(), scan.view_direction) for scan in three().scans]
    before = digest(scans)
    mvreg.register(scans, method)
    assert digest(scans) == before


@pytest.mark.parametrize("name", METHODS)
def test_every_method_places_them(name):
    found = mvreg.register(three(), name, changes={} if name == "auto" else CHANGES)
    assert found.unregistered == ()
    assert placed_like(found, three(), three().poses) < 3.0


def test_changes_reach_the_stages():
    found = mvreg.load_method("fcpma", {"refine": "icp", "seed.top_fraction": 0.5, "judge": "tmse"})
    assert type(found.pipeline.refine).__name__ == "ICP"
    assert type(found.pipeline.judge).__name__ == "TmseJudge"
    assert found.pipeline.seed.top_fraction == 0.5
    assert found.name == "fcpma"
    assert mvreg.load_method().name == "auto"


def test_changes_do_not_go_with_a_method_made_by_hand(method):
    with pytest.raises(mvreg.InputError, match="put together already"):
        mvreg.register(three(), method, changes={"refine": "icp"})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "fcpm"}, r"\+method=fcpm does not exist; options: .*fcpma"),
        ({"method": "Müller's"}, r"\+method=Müller's does not exist; options: .*fcpma"),
        ({"changes": {"refine": "foo"}}, "refine=foo is not registered; options: .*icp, .*tricp"),
        ({"changes": {"refine.foo": 1}}, "foo"),
        ({"changes": {"fine.foo": 1}}, "fine"),
        ({"changes": {"seed.top_fraction": 7}}, r"seed\.top_fraction: expected a share"),
        ({"changes": {"seed.top_fraction": "much"}}, "could not be converted to Float"),
        ({"changes": {"describe.orient": "up"}}, "expected one of .*auto, estimated"),
    ],
)
def test_what_does_not_exist_is_refused_with_the_options(arguments, message):
    with pytest.raises(mvreg.InputError, match=message):
        mvreg.register(three(), **arguments)


POINTS = np.random.default_rng(0).normal(size=(50, 3))


@pytest.mark.parametrize(
    ("scans", "message"),
    [
        ([], r"at least two scans .*got 0 scan"),
        ([POINTS], r"at least two scans .*got 1 scan"),
        ([Scan("a", POINTS), Scan("a", POINTS)], "got a twice"),
        ([Scan("scan_001", POINTS), POINTS], "scan_001 twice"),
        ([POINTS, POINTS[:, :2]], r"'scan_001': expected points \(N, 3\), got \(50, 2\)"),
        ([POINTS, POINTS.ravel()], r"'scan_001': expected points \(N, 3\), got \(150,\)"),
        ([POINTS, POINTS[None, None]], r"'scan_001': expected .*\(N, 3\), got \(1, 1, 50, 3\)"),
        ([POINTS, np.empty((0, 3))], "'scan_001': expected at least one point, got none"),
        ([np.where(POINTS > 2, np.nan, POINTS), POINTS], r"'scan_000': \d+ of 50 points are NaN"),
        ([POINTS, POINTS * [1, 1, np.inf]], "'scan_001': 50 of 50 points are NaN or infinite"),
        (POINTS, "expected several scans, got one ndarray; pass a list of them"),
    ],
)
def test_wrong_scans_are_refused(scans, message, method):
    with pytest.raises(mvreg.InputError, match=message):
        mvreg.register(scans, method)


def test_poor_scans_among_good_ones_are_reported(method, result):
    good, poor = list(three().scans), poor_scans()
    found = mvreg.register([*good[:1], *poor[:3], *good[1:], *poor[3:]], method)
    assert set(found.unregistered) == {scan.name for scan in poor}
    assert set(found.poses) == {scan.name for scan in good}
    assert placed_like(found, three(), three().poses) < 3.0
    for pair in found.pairs:
        assert not pair.verdict.reliable or pair.source in found.poses
        assert pair.verdict.reason


def test_a_poor_reference_places_nothing(method):
    single = Scan("single", np.ones((1, 3)))
    found = mvreg.register([single, *three().scans], method)
    assert list(found.poses) == ["single"]
    assert len(found.unregistered) == 3
    np.testing.assert_array_equal(found.poses["single"], np.eye(4))


@pytest.mark.parametrize("name", METHODS)
def test_only_poor_scans_end_well(name):
    found = mvreg.register(poor_scans(), name)
    assert len(found.poses) + len(found.unregistered) == len(poor_scans())
    assert found.reference == "one point"
    assert list(found.poses) == ["one point"]


@pytest.mark.parametrize("scans", [plane_scans(), blob_scans(2, relief=0.0)], ids=lambda s: s.name)
def test_featureless_scans_end_well(scans, method):
    found = mvreg.register(scans, method)
    assert len(found.poses) + len(found.unregistered) == 2
    for pose in found.poses.values():
        assert np.isfinite(pose).all()


def test_observers_are_told_everything_in_order(method):
    told = []
    observer = SimpleNamespace(mvreg_event=lambda event: told.append(event))
    found = mvreg.register(three(), method, observers=[observer])
    kinds = [type(event) for event in told]
    assert kinds[:4] == [*[events.ViewPrepared] * 3, events.ReferenceChosen]
    assert kinds.count(events.PairStarted) == len(found.pairs)
    registered = [event for event in told if isinstance(event, events.PairRegistered)]
    assert [event.pair for event in registered] == list(found.pairs)
    mvreg.register(three(), method)
    assert len(told) == len(kinds), "only during its own run"


def test_an_observer_that_fails_is_switched_off(method, result):
    told = []

    def fail(event):
        told.append(event)
        raise RuntimeError("no screen")

    with pytest.warns(ObserverWarning, match=r"failed on ViewPrepared .*no screen"):
        found = mvreg.register(three(), method, observers=[SimpleNamespace(mvreg_event=fail)])
    assert len(told) == 1
    assert digest(found.poses) == digest(result.poses)


def test_a_misspelt_hook_is_refused(method):
    observer = SimpleNamespace(mvreg_evnt=lambda event: None)
    with pytest.raises(mvreg.PluginError, match="did you mean 'mvreg_event'"):
        mvreg.register(three(), method, observers=[observer])


def test_a_library_call_leaves_nothing_behind(method, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    before = GlobalHydra.instance().hydra
    mvreg.register(three(), "fcpma", changes=CHANGES)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")
    assert GlobalHydra.instance().hydra is before


def test_data_sets_are_loaded_by_name():
    small = {"views": 5, "points": 100, "shape": "sphere", "order": "shuffle"}
    scans, again = mvreg.dataset("tiny", rng=4, **small), mvreg.dataset("tiny", rng=4, **small)
    assert digest(scans) == digest(again)
    assert (scans.name, scans.unit, len(scans.scans)) == ("tiny_sphere", "mm", 5)
    other = mvreg.dataset("tiny", rng=5, **small)
    assert [scan.name for scan in other.scans] != [scan.name for scan in scans.scans]


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("bunnny", {}, "dataset=bunnny is not registered; options: .*bunny"),
        ("tiny", {"vews": 3}, "vews"),
        ("tiny", {"views": "many"}, "could not be converted to Integer"),
        ("tiny", {"shape": "cube"}, "shape='cube' is not known; options: gnome"),
        ("folder", {"path": "1e5"}, r"dataset\.path=1e5: expected a folder"),
        ("folder", {"path": "Müller's\\scans"}, r"dataset\.path=Müller's\\scans: expected a fold"),
    ],
)
def test_a_data_set_that_cannot_be_loaded_says_why(name, parameters, message):
    with pytest.raises(mvreg.InputError, match=message):
        mvreg.dataset(name, **parameters)


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["C"])),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(st.from_regex(r"[a-z]{1,3}(\.[a-z]{1,3})?", fullmatch=True), inner,
                      max_size=3),
)  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(values)
@pytest.mark.parametrize("parser", [OverridesParser.create()])
def test_what_is_passed_on_is_what_hydra_reads(parser, value):
    found = parser.parse_override(f"key={spelled(value)}").value()
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize("dataset", ["tiny", "figurine", "bunny", "dragon", "buddha", "armadillo"])
@pytest.mark.parametrize("name", METHODS)
def test_every_method_goes_with_every_data_set(name, dataset):
    chosen = [] if name == "auto" else [f"+method={name}"]
    config = compose([*chosen, f"dataset={dataset}"])
    assert method_from(config).name == config.method == name


def test_every_method_of_the_project_is_tested_here():
    files = resources.files("mvreg.conf.method").iterdir()
    found = {file.name[:-5] for file in files if file.name.endswith(".yaml")}
    assert {*found, "auto"} == set(METHODS)


@pytest.mark.parametrize("scans", ["my_scans", Path("my_scans")])
def test_a_path_is_no_scan(scans):
    with pytest.raises(mvreg.InputError, match=r"mvreg\.dataset"):
        mvreg.register(scans)


def test_what_is_no_array_is_refused_as_wrong_input():
    with pytest.raises(mvreg.InputError, match="got object"):
        mvreg.register([object(), object()])


def test_a_negative_rng_is_refused():
    with pytest.raises(mvreg.InputError, match="rng"):
        mvreg.register([np.eye(3), np.eye(3)], rng=-1)


def test_a_scan_keeps_its_points_whatever_becomes_of_the_caller_s():
    points = np.ones((5, 3))
    scan = mvreg.Scan("a", points)
    points *= 1000
    assert scan.points.max() == 1.0
    with pytest.raises(ValueError, match="read-only"):
        scan.points[0] = 0


@pytest.mark.parametrize(
    ("stage", "changes"),
    [
        ("propagate.distance_tolerance", {"propagate.distance_tolerance": -1}),
        ("describe.normal_scale", {"describe": "eigenvalues", "describe.normal_scale": 9}),
        ("refine.max_iterations", {"refine.max_iterations": -1}),
    ],
)
def test_parameters_out_of_range_are_refused_by_name(stage, changes):
    with pytest.raises(mvreg.InputError, match=stage):
        mvreg.load_method(changes=changes)
