"""Runs of the same command that share the work by meeting in the store."""

import json
import subprocess
import sys
import time

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.events import ignore
from mvreg.execution import Shards
from mvreg.execution.shards import waited_for
from mvreg.run import load_method, run
from mvreg.store.folder import FolderStore, NoStore
from mvreg.testing import blob_scans


def test_two_runs_share_the_work_and_agree(tmp_path):
    words = ["dataset=figurine", "dataset.views=6", "dataset.points=5000", "rerun=false"]
    start = [sys.executable, "-m", "mvreg", *words, "report=false"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "cwd": tmp_path, "text": True}
    runs = [
        subprocess.Popen(
            [*start, f"store={tmp_path / 'store'}", f"shard={k}/2", f"hydra.run.dir=run{k}"],
            **quiet,
        )
        for k in (1, 2)
    ]
    runs.append(subprocess.Popen([*start, "store=false", "hydra.run.dir=alone"], **quiet))
    for child in runs:
        _, said = child.communicate(timeout=120)
        assert child.returncode == 0, said
    found = [
        json.loads((tmp_path / name / "result.json").read_text())
        for name in ("run1", "run2", "alone")
    ]
    for one in found[:2]:
        assert one["poses"] == found[2]["poses"]
        assert one["covariances"] == found[2]["covariances"]
    assert not list((tmp_path / "store").rglob("*.part"))


def test_a_run_whose_others_are_gone_does_their_work(tmp_path):
    scans = blob_scans(5).scans
    alone = run(scans, load_method("auto"), np.random.default_rng(1), ignore)[0]
    store = FolderStore(tmp_path, 10**9)
    shard = Shards("2/3", patience=0.01)
    found = run(scans, load_method("auto"), np.random.default_rng(1), ignore, store, shard)[0]
    for name, pose in alone.poses.items():
        np.testing.assert_array_equal(found.poses[name], pose)


def test_patience_ends_once_and_not_for_each_attempt(tmp_path):
    store, limit = FolderStore(tmp_path, 10**9), time.monotonic() + 0.2
    for _ in range(20):
        assert not waited_for("0" * 48, store, limit)
    assert time.monotonic() < limit + 1
    store.keep("1" * 48, 1)
    assert waited_for("1" * 48, store, limit), "what is there needs no patience"


@pytest.mark.parametrize("part", ["", "0/2", "3/2", "a/b", "1", "-1/2"])
def test_a_share_that_is_none_is_refused(part):
    with pytest.raises(InputError, match="expected i/n"):
        Shards(part)


def test_a_store_is_needed():
    with pytest.raises(InputError, match="store=DIR"):
        Shards("1/2").session(NoStore())
