"""Finished work is found again: nothing twice, nothing different, whatever interrupts."""

import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from mvreg.events import PairRegistered, ignore
from mvreg.library import dataset
from mvreg.run import load_method, run
from mvreg.stages.describe.spectrum import SpectrumDescribe
from mvreg.store.folder import FolderStore, NoStore
from mvreg.testing import blob_scans


def registered(store, method=None, scans=None, emit=ignore):
    scans = blob_scans(5).scans if scans is None else scans
    return run(scans, method or load_method("auto"), np.random.default_rng(1), emit, store)[0]


def assert_same(first, second):
    assert first.poses.keys() == second.poses.keys()
    for name, pose in first.poses.items():
        np.testing.assert_array_equal(pose, second.poses[name])
    for name, covariance in first.covariances.items():
        np.testing.assert_array_equal(covariance, second.covariances[name])
    assert [p.verdict for p in first.pairs] == [p.verdict for p in second.pairs]


def test_the_same_again_is_found_and_is_the_same(tmp_path):
    alone = registered(NoStore())
    first, second = FolderStore(tmp_path, 10**9), FolderStore(tmp_path, 10**9)
    told, again = [], []
    assert_same(registered(first, emit=told.append), alone)
    assert_same(registered(second, emit=again.append), alone)
    assert first.use.kept == second.use.found > 5
    assert second.use.kept == 0
    pairs = [[e.pair for e in one if isinstance(e, PairRegistered)] for one in (told, again)]
    assert [p.verdict for p in pairs[0]] == [p.verdict for p in pairs[1]]


def test_another_judge_asks_for_no_other_description(tmp_path, monkeypatch):
    registered(FolderStore(tmp_path, 10**9))
    described = []
    asked = SpectrumDescribe.__call__
    monkeypatch.setattr(
        SpectrumDescribe, "__call__", lambda *args: described.append(1) or asked(*args)
    )
    store = FolderStore(tmp_path, 10**9)
    method = load_method("auto", {"judge.min_probability": 0.94})
    registered(store, method)
    assert not described
    assert store.use.kept > 0, "the attempts are made anew"


def test_one_moved_point_is_another_scan(tmp_path):
    scans = blob_scans(5).scans
    registered(FolderStore(tmp_path, 10**9), scans=scans)
    points = scans[2].points.copy()
    points[10] += 1e-3
    changed = [*scans[:2], replace(scans[2], points=points), *scans[3:]]
    store = FolderStore(tmp_path, 10**9)
    assert_same(registered(store, scans=changed), registered(NoStore(), scans=changed))
    assert store.use.kept > 0


@pytest.mark.parametrize("share", [0.2, 0.4, 0.6, 0.8])
def test_a_killed_run_goes_on_where_it_was(tmp_path, share):
    words = ["dataset=tiny", "rerun=false", f"store={tmp_path / 'store'}"]
    start = [sys.executable, "-m", "mvreg", *words]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    child = subprocess.Popen([*start, "hydra.run.dir=first"], **quiet)
    wanted = 13 * share  # six descriptions, scores, five attempts, one refinement
    limit = time.monotonic() + 60
    while len(list(tmp_path.rglob("*.safetensors"))) < wanted and child.poll() is None:
        assert time.monotonic() < limit
        time.sleep(0.001)
    child.send_signal(signal.SIGKILL)
    child.wait()
    store = FolderStore(tmp_path / "store", 10**9)
    kept = len(list(store.known()))
    scans = dataset("tiny").scans
    result = run(scans, load_method("auto"), np.random.default_rng(0), ignore, store)[0]
    assert store.use.found == kept >= wanted and not store.use.damaged
    alone = run(scans, load_method("auto"), np.random.default_rng(0), ignore, NoStore())[0]
    assert_same(result, alone)
