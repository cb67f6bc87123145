"""How far a registration is, and calling it off."""

import gc
import threading
import time
from dataclasses import dataclass, replace

import numpy as np
import pytest

import mvreg
from mvreg.errors import MvregError
from mvreg.evaluation.assess import assess
from mvreg.events import PairRegistered
from mvreg.stages import SpectrumDescribe
from mvreg.testing import blob_scans


@pytest.fixture(scope="module")
def scans():
    return mvreg.dataset("tiny", views=4)


@pytest.fixture(scope="module")
def plain(scans):
    return mvreg.register(scans)


def same(first, second):
    assert first.poses.keys() == second.poses.keys()
    return all(np.array_equal(first.poses[name], second.poses[name]) for name in first.poses)


def test_progress_is_told_from_the_first_scan_to_the_adjustment(scans, plain):
    told, threads = [], set()

    def listen(now):
        told.append(now)
        threads.add(threading.get_ident())

    result = mvreg.register(scans, progress=listen)
    assert same(result, plain)
    assert threads == {threading.get_ident()}
    steps = list(dict.fromkeys(now.step for now in told))
    assert steps == ["prepare", "register", "adjust"]
    assert [now.done for now in told if now.step == "prepare"] == [0, 1, 2, 3, 4]
    assert {now.total for now in told} == {4}
    assert told[-1].done == 4 and told[-1].pairs == len(result.pairs)
    assert told[0].so_far is not None and told[-1].so_far().poses.keys() == result.poses.keys()
    seconds = [now.seconds for now in told]
    assert seconds == sorted(seconds)
    assert any("registering tiny_" in now.text for now in told)


@pytest.mark.parametrize("stop", [False, np.False_], ids=["False", "NumPy's"])
@pytest.mark.parametrize("method", ["auto", "fcpma"])
def test_false_calls_it_off_and_what_was_placed_is_kept(scans, stop, method):
    def listen(now):
        enough = now.step == "register" and now.pairs and len(now.so_far().poses) == 2
        return stop if enough else None

    with pytest.raises(mvreg.CancelledError, match=r"called off .*; 2 scans placed by") as caught:
        mvreg.register(scans, method, progress=listen)
    assert isinstance(caught.value, MvregError)
    found = caught.value.result
    assert len(found.poses) == 2 and len(found.unregistered) == 2
    assert found.poses.keys() | set(found.unregistered) == {scan.name for scan in scans.scans}
    assert [pair.verdict.reliable for pair in found.pairs].count(True) >= 1
    errors = mvreg.pose_errors(found.poses, scans.poses, found.reference)
    assert errors.max.translation < 3  # mm
    assert set(assess(found).scans) >= set(found.poses)


def test_called_off_before_the_first_scan_there_is_nothing(scans):
    with pytest.raises(mvreg.CancelledError, match="no scan placed by then") as caught:
        mvreg.register(scans, progress=lambda now: False)
    assert caught.value.result is None


class TookTooLongError(Exception):
    """A program's own."""


@pytest.mark.parametrize("error", [TookTooLongError("two seconds"), KeyboardInterrupt()], ids=repr)
def test_what_it_raises_comes_out_as_it_is(scans, error):
    seen = []

    def listen(now):
        seen.append(now)
        if now.step == "adjust":
            raise error

    with pytest.raises(type(error)) as caught:
        mvreg.register(scans, progress=listen)
    assert caught.value is error
    assert len(seen[-1].so_far().poses) == 4  # what was finished is still to be had


def test_no_stage_can_keep_it_from_stopping(scans):
    class Stubborn(mvreg.load_method("fcpma").strategy.__class__):
        def __call__(self, views, pipeline, rng):
            try:
                return super().__call__(views, pipeline, rng)
            except Exception:
                raise AssertionError("it was caught") from None

    method = mvreg.load_method("fcpma")
    method = mvreg.Method("stubborn", method.pipeline, Stubborn(), method.adjust)
    with pytest.raises(mvreg.CancelledError):
        mvreg.register(scans, method, progress=lambda now: now.pairs < 1)


def test_with_a_store_the_next_call_goes_on_from_there(scans, plain, tmp_path):
    with pytest.raises(mvreg.CancelledError):
        mvreg.register(scans, store=tmp_path, progress=lambda now: now.pairs < 2)
    full = []

    class Watch:
        def mvreg_event(self, event):
            if isinstance(event, PairRegistered):
                full.append(len(event.candidates) > 0 or len(event.seeds) > 0)

    assert same(mvreg.register(scans, store=tmp_path, observers=[Watch()]), plain)
    assert full.count(False) >= 2, "an attempt that was finished is found again"


def test_observers_are_let_go(scans):
    from mvreg.plugins import manager

    class Watch:
        def mvreg_event(self, event):
            pass

    before = len(manager.current().hook.mvreg_event.get_hookimpls())
    with pytest.raises(mvreg.CancelledError):
        mvreg.register(scans, observers=[Watch()], progress=lambda now: now.pairs < 1)
    assert len(manager.current().hook.mvreg_event.get_hookimpls()) == before
    gc.collect()
    assert same(mvreg.register(scans), mvreg.register(scans))


def test_fixed_scans_keep_their_frame_when_it_is_called_off(scans):
    world = np.eye(4)
    world[:3, 3] = 1000.0, 2000.0, 3000.0
    first, *others = scans.scans
    fixed = mvreg.Scan(first.name, first.points, first.view_direction, first.view_point,
                       initial=world, fixed=True)  # fmt: skip
    with pytest.raises(mvreg.CancelledError) as caught:
        mvreg.register([fixed, *others], progress=lambda now: now.step != "adjust")
    np.testing.assert_allclose(caught.value.result.poses[first.name], world, atol=1e-9)


@dataclass(frozen=True)
class Slow(SpectrumDescribe):
    """Takes its time, and counts."""

    def __call__(self, scan, keypoints, spacing):
        time.sleep(0.05)
        DESCRIBED.append(scan.name)
        return super().__call__(scan, keypoints, spacing)


DESCRIBED: list[str] = []


def test_what_was_queued_is_not_worked_on_any_more(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    method = mvreg.load_method("fcpma")
    method = replace(method, pipeline=method.pipeline.with_stages(describe=Slow()))
    points = blob_scans(3).scans[0].points
    with pytest.raises(mvreg.CancelledError):
        mvreg.register([points] * 30, method, progress=lambda now: now.done < 2)
    time.sleep(0.5)
    assert 2 <= len(DESCRIBED) <= 8
