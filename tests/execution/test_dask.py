"""Workers of a Dask cluster come to the answer of the threads, whatever happens to them."""

import os
import pickle
import signal

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.events import PairRegistered, ignore
from mvreg.execution import Dask
from mvreg.execution.dask import memory_limit
from mvreg.execution.worker import Scans
from mvreg.run import load_method, run
from mvreg.store.content import digest, stage_digest
from mvreg.store.folder import FolderStore, NoStore
from mvreg.testing import blob_scans, blob_views
from mvreg.types.scan import Scan

pytest.importorskip("distributed", reason="executor=dask is NOT TESTED: pip install 'mvreg[dask]'")


def scattered(count=6):
    """Scans of which several pairs are attempted in one round."""
    scans = blob_scans(count).scans
    return [Scan(scan.name, scan.points, view_direction=scan.view_direction) for scan in scans]


def placed(store, executor=None, emit=ignore):
    more = () if executor is None else (executor,)
    return run(scattered(), load_method("auto"), np.random.default_rng(1), emit, store, *more)[0]


def assert_same(first, second):
    assert first.poses.keys() == second.poses.keys()
    for name, pose in first.poses.items():
        np.testing.assert_array_equal(pose, second.poses[name])
    assert [p.verdict for p in first.pairs] == [p.verdict for p in second.pairs]


@pytest.mark.filterwarnings("default")
def test_workers_and_threads_agree_also_when_one_is_killed(tmp_path):
    alone = placed(NoStore())
    store = FolderStore(tmp_path / "whole", 10**9)
    told = []
    assert_same(placed(store, Dask(workers=2), told.append), alone)
    assert store.use.found == 0, "nothing was there before this run"
    again = FolderStore(tmp_path / "whole", 10**9)
    assert_same(placed(again, Dask(workers=1)), alone)
    assert again.use.found > 5 and again.use.kept == 0
    assert sum(isinstance(event, PairRegistered) for event in told) == len(alone.pairs)

    from distributed import get_client

    def kill_one(event):
        if isinstance(event, PairRegistered) and not killed:
            killed.extend(get_client().run(os.getpid).values())
            os.kill(killed[0], signal.SIGKILL)

    killed = []
    assert_same(placed(FolderStore(tmp_path / "killed", 10**9), Dask(workers=2), kill_one), alone)
    assert killed


def test_a_store_is_needed():
    with pytest.raises(InputError, match="store=DIR"), Dask().session(NoStore()):
        pass


@pytest.mark.filterwarnings("default")
def test_an_address_where_nobody_answers_is_refused(tmp_path):
    executor = Dask(address="tcp://127.0.0.1:9", timeout=0.5)
    with (
        pytest.raises(InputError, match=r"executor\.address=tcp"),
        executor.session(FolderStore(tmp_path, 10**9)),
    ):
        pass


def test_parameters_are_checked():
    for wrong in ({"workers": -1}, {"timeout": 0.0}):
        with pytest.raises(InputError, match="executor"):
            Dask(**wrong)


def test_checked_stages_reach_another_process():
    pipeline = load_method("auto").pipeline.checked().without_surroundings()
    again = pickle.loads(pickle.dumps(pipeline))
    for kind in ("refine", "judge", "propagate"):
        stage, other = getattr(pipeline, kind), getattr(again, kind)
        assert type(other) is type(stage)
        assert stage_digest(other) == stage_digest(stage)


def test_a_worker_holds_as_many_scans_as_it_has_room_for(tmp_path):
    store = FolderStore(tmp_path, 10**9)
    keys = [digest("view", k) for k in range(3)]
    for key, view in zip(keys, blob_views(3), strict=True):
        store.keep(key, view)
    size = store.file(keys[0]).stat().st_size
    held = Scans(20 * size)  # with all that is derived, two of them
    views = [held.get(key, store) for key in keys]
    assert [view.name for view in views] == [view.name for view in blob_views(3)]
    assert list(held.held) == keys[1:]
    assert held.get(keys[2], store) is views[2]
    with pytest.raises(InputError, match="store_size"):
        held.get(digest("none"), store)


def test_workers_here_get_memory_for_their_scans(tmp_path):
    store = FolderStore(tmp_path, 10**12)
    few = memory_limit(store, 1000)
    store.keep(digest("large"), np.zeros(10**6))
    assert memory_limit(store, 1000) > few
