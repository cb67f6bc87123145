import sys
from pathlib import Path

import numpy as np
import pytest
from mvreg_peers.kiss_gicp import KissGicpStrategy
from peer_cases import PeerContract, assert_repeatable, bunny, errors_of

import mvreg
from mvreg.testing import blob_views, pipeline

NEEDED = ("kiss_matcher", "small_gicp")


@pytest.fixture
def extra() -> None:
    """The two libraries; without them the test is skipped, and says so."""
    for name in NEEDED:
        pytest.importorskip(name, reason="needs pip install 'mvreg-peers[kiss]'")


@pytest.mark.usefixtures("extra")
class TestKissGicp(PeerContract):
    stage = KissGicpStrategy(voxel=2.5)  # for scans of few points
    library = "kiss_matcher"


@pytest.mark.parametrize("missing", NEEDED)
def test_a_missing_extra_is_named_and_how_to_install_it(missing, monkeypatch):
    for name in NEEDED:
        monkeypatch.setitem(sys.modules, name, None if name == missing else sys)
    stage, views = KissGicpStrategy(), list(blob_views(2))
    with pytest.raises(mvreg.PluginError, match=rf"{missing}.*pip install 'mvreg-peers\[kiss\]'"):
        stage(views, pipeline(), np.random.default_rng(0))


def test_what_needs_the_extra_is_not_imported_before_it_runs(monkeypatch):
    for name in NEEDED:
        monkeypatch.setitem(sys.modules, name, None)
    method = mvreg.load_method("kiss_gicp")
    assert method.name == "kiss_gicp"
    assert method.strategy == KissGicpStrategy()
    assert type(method.pipeline.describe).__name__ == "NoDescribe"


@pytest.mark.parametrize(
    "wrong", [{"voxel": 0}, {"min_overlap": 1.5}, {"min_overlap": 0}, {"max_iterations": 0}]
)
def test_parameters_out_of_range_are_refused(wrong):
    with pytest.raises(mvreg.InputError, match=rf"strategy\.{next(iter(wrong))}: expected"):
        KissGicpStrategy(**wrong)


@pytest.mark.slow
@pytest.mark.usefixtures("extra")
def test_bunny_shuffled_and_scrambled(data_root: Path):
    scans = bunny(data_root)
    errors = errors_of(mvreg.register(scans, "kiss_gicp", 1), scans)
    assert errors.mean.rotation <= 0.0130
    assert errors.mean.translation <= 1.3


@pytest.mark.slow
@pytest.mark.usefixtures("extra")
def test_bunny_is_the_same_twice(data_root: Path, monkeypatch: pytest.MonkeyPatch):
    assert_repeatable(bunny(data_root), "kiss_gicp", monkeypatch)
