"""What the tests of both peers share."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

import pytest
from mvreg_peers import pairs
from mvreg_peers.suites import RawScansContract

import mvreg
from mvreg import events
from mvreg.evaluation.pose_errors import PoseErrors, pose_errors
from mvreg.tbb import copies_of_tbb, threads_allowed
from mvreg.testing.compare import digest
from mvreg.types import Result, ScanSet

#: A rotation further off is a false placement (degrees).
WRONG = 5.0


class PeerContract(RawScansContract):
    """The suite for strategies that work on raw scans, without keypoints; nothing is waived."""

    #: The module that comes with oneTBB.
    library: ClassVar[str]

    def test_the_number_of_threads_does_not_matter(self, monkeypatch: Any) -> None:
        arguments = self.examples()["three views"]
        found = []
        for threads in (1, 3):
            monkeypatch.setattr(pairs.os, "cpu_count", lambda threads=threads: threads)
            found.append(self.essence(self.call(*arguments)))
        assert found[0] == found[1]

    def test_its_libraries_start_no_threads_of_their_own(self) -> None:
        """Small scans would not show it: they are added up in one piece."""
        views, pipe = self.examples()["one has no keypoints"]
        mvreg.load_open3d()
        (library,) = copies_of_tbb(import_module(self.library))
        allowed: list[int] = []
        self.call(views, pipe.observed_by(lambda event: allowed.append(threads_allowed(library))))
        assert allowed[2] == 1  # the first pair has been registered

    def test_observers_are_told_of_all_pairs_and_poses(self) -> None:
        views, pipe = self.examples()["one has no keypoints"]
        told: list[Any] = []
        answer = self.call(views, pipe.observed_by(told.append))
        kinds = [type(event) for event in told]
        assert kinds == [
            events.ReferenceChosen,
            *[events.PairStarted, events.PairRegistered] * 3,
            events.ViewPlaced,
        ]
        ended = [event for event in told if isinstance(event, events.PairRegistered)]
        assert tuple(event.pair for event in ended) == answer.pairs
        first, *others = ended
        assert first.pair.verdict.reliable and first.registration is not None
        assert first.registration.overlap == first.pair.overlap > 0.3
        assert set(first.pair.seconds) == {"propagate", "refine"}
        assert len(first.candidates) == 1
        assert all("too few points" in event.pair.verdict.reason for event in others)
        assert told[-1].T_model_scan is answer.poses[views[1].name]


def bunny(data_root: Path) -> ScanSet:
    """The Bunny, in an order and in frames drawn at random."""
    return mvreg.dataset("bunny", rng=1, root=str(data_root), order="shuffle", scramble=True)


def assert_repeatable(scans: ScanSet, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Real scans are large enough for libraries to add them up in pieces."""
    found = []
    for threads in (1, 3):
        monkeypatch.setattr(pairs.os, "cpu_count", lambda threads=threads: threads)
        result = mvreg.register(scans.scans[:3], method, rng=1)
        found.append(
            digest(replace(result, pairs=tuple(replace(p, seconds={}) for p in result.pairs)))
        )
        assert any(pair.verdict.reliable for pair in result.pairs)
    assert found[0] == found[1]


def errors_of(result: Result, scans: ScanSet) -> PoseErrors:
    """The errors of a run that placed every scan, none of them wrong."""
    assert result.unregistered == ()
    assert len(result.pairs) == len(scans.scans) * (len(scans.scans) - 1) / 2
    found = pose_errors(result.poses, scans.poses, result.reference)
    assert found is not None
    assert found.max.angle < WRONG
    return found
