"""Turns a run into a recording for the Rerun viewer, ``run.rrd``.

`entities` maps an event to what is to be shown, and needs no viewer; `RerunObserver` writes it.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from mvreg.events import (
    Event,
    PairRegistered,
    PairStarted,
    PosesRevised,
    ReferenceChosen,
    RunFinished,
    RunStarted,
    ViewPlaced,
    ViewPrepared,
)
from mvreg.observers.rerun import archetypes, confidence
from mvreg.observers.rerun.layout import side_by_side
from mvreg.plugins.hookspecs import hookimpl
from mvreg.types import Array, View

if TYPE_CHECKING:
    from rerun import RecordingStream

#: What is logged at one moment: where, and which archetype.
Entities = list[tuple[str, Any]]


@dataclass(frozen=True)
class Seen:
    """What earlier events told.

    The prepared views by name, in order; how many pairs began; the target that is drawn; and the
    scans that stand in the model.
    """

    views: Mapping[str, View] = field(default_factory=lambda: MappingProxyType({}))
    pair: int = 0
    target: View | None = None
    placed: frozenset[str] = frozenset()
    most: int = archetypes.MOST_POINTS

    def after(self, event: Event) -> Seen:
        """What is known once `event` has happened."""
        match event:
            case RunStarted():
                return replace(self, most=archetypes.most_points(len(event.scanset.scans)))
            case ViewPrepared():
                return replace(self, views={**self.views, event.view.name: event.view})
            case PairStarted():
                return replace(self, pair=self.pair + 1)
            case PairRegistered():
                return replace(self, target=event.target)
            case ReferenceChosen():
                return replace(self, placed=self.placed.union(event.model.members))
            case ViewPlaced():
                return replace(self, placed=self.placed | {event.name})
            case PosesRevised():
                return replace(self, placed=frozenset().union(event.poses, *event.components))
            case RunFinished():
                return replace(self, pair=self.pair + 1)
        return self


def entities(event: Event, seen: Seen) -> Entities:
    """What an event shows, given what was `seen` before it: pairs of entity path and archetype."""
    match event:
        case ReferenceChosen():
            return [item for name in event.model.members for item in _placed(name, None, seen)]
        case PairRegistered():
            return _clouds(event, seen) + _lines(event) + _numbers(event)
        case ViewPlaced():
            return _placed(event.name, event.T_model_scan, seen)
        case PosesRevised():
            return _revised(side_by_side(event.poses, event.components, seen.views), seen)
        case RunFinished():
            return _finished(event, seen)
    return []


def _finished(event: RunFinished, seen: Seen) -> Entities:
    """The poses after the adjustment, which may have moved them all, and what they are worth."""
    shown = side_by_side(event.result.poses, event.result.components, seen.views)
    spots = confidence.middles(shown, seen.views)
    dots, lines = confidence.dots(spots, event.report), confidence.lines(spots, event.report)
    return [*_revised(shown, seen), ("confidence/scans", dots), ("confidence/pairs", lines)]


def _revised(shown: Mapping[str, Array], seen: Seen) -> Entities:
    """All scans where they stand now; what has lost its pose is taken away."""
    gone = [(_path(name), archetypes.nothing()) for name in seen.placed if name not in shown]
    return gone + [item for name in shown for item in _placed(name, shown[name], seen)]


def _path(name: str) -> str:
    return f"model/{archetypes.escape(name)}"


def _placed(name: str, T_model_scan: Array | None, seen: Seen) -> Entities:
    """A scan in the model: its points, once, in a colour of its own, under its pose."""
    if name not in seen.views:
        return []
    shown: Entities = [(_path(name), archetypes.pose(T_model_scan))]
    if name not in seen.placed:
        color = archetypes.hue(list(seen.views).index(name))
        shown.append((_path(name), archetypes.cloud(seen.views[name], color, seen.most)))
    return shown


def _clouds(event: PairRegistered, seen: Seen) -> Entities:
    """Target, source before (beside it) and source after, green or red by the verdict."""
    shown: Entities = []
    if event.target is not seen.target:
        shown.append(("pair/target", archetypes.cloud(event.target, archetypes.GREY, seen.most)))
    aside = archetypes.beside(event.source, event.target)
    shown.append(("pair/before", archetypes.pose(aside)))
    shown.append(("pair/before", archetypes.cloud(event.source, archetypes.BLUE, seen.most)))
    if event.registration is None:
        shown.append(("pair/after", archetypes.nothing()))
        return shown
    color = archetypes.GREEN if event.pair.verdict.reliable else archetypes.RED
    shown.append(("pair/after", archetypes.pose(event.registration.T_target_source)))
    shown.append(("pair/after", archetypes.cloud(event.source, color, seen.most)))
    return shown


def _lines(event: PairRegistered) -> Entities:
    """Seed matches, and the propagated matches of the best candidate."""
    best = event.candidates.matches[0] if event.candidates.matches else None
    pair = event.source, event.target
    return [
        ("pair/seeds", archetypes.matches(*pair, event.seeds.indices, archetypes.YELLOW)),
        ("pair/propagated", archetypes.matches(*pair, best, archetypes.CYAN)),
    ]


def _numbers(event: PairRegistered) -> Entities:
    """Score against threshold, TMSE and overlap over the pairs, and the verdict in words."""
    pair, verdict = event.pair, event.pair.verdict
    word = "accepted" if verdict.reliable else "rejected"
    shown = [("verdicts", archetypes.verdict(pair))]
    if pair.trimmed_mse is None:
        return shown
    return [
        *shown,
        ("judge/score", archetypes.scalar(verdict.score)),
        ("judge/threshold", archetypes.scalar(verdict.threshold)),
        (f"judge/{word}", archetypes.scalar(verdict.score)),
        ("tmse/trimmed_mse", archetypes.scalar(pair.trimmed_mse)),
        ("overlap/overlap", archetypes.scalar(pair.overlap)),
    ]


class RerunObserver:
    """Writes a recording; one per run. View it with ``rerun run.rrd``.

    In a thread of its own, one event after the other, so that a run does not wait for the pictures
    of it. What fails there is raised on the next event, and on the last at the latest.

    Parameters
    ----------
    path : Path
        The file; its folder is made if it is missing.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._seen = Seen()
        self._stream: RecordingStream | None = None
        self._thread = ThreadPoolExecutor(1, "mvreg-rerun")
        self._waiting: list[Future[None]] = []

    @hookimpl
    def mvreg_event(self, event: Event) -> None:
        """Record one event at the number of its pair."""
        while self._waiting and self._waiting[0].done():
            self._waiting.pop(0).result()
        self._waiting.append(self._thread.submit(self._record, event))
        if isinstance(event, RunFinished):
            while self._waiting:
                self._waiting.pop(0).result()

    def _record(self, event: Event) -> None:
        if isinstance(event, RunStarted):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = archetypes.open_recording(
                self._path, f"{event.scanset.name} {event.method}"
            )
        if self._stream is None:
            return
        shown = entities(event, self._seen)
        self._seen = self._seen.after(event)
        self._stream.set_time("pair", sequence=self._seen.pair)
        for path, archetype in shown:
            self._stream.log(path, archetype)
        if isinstance(event, RunFinished):
            self._end()

    def _end(self) -> None:
        if self._stream is not None:
            self._stream.flush()
            self._stream.disconnect()
            self._stream = None

    def give_up(self) -> bool:
        """End the recording and remove its file; says whether there was one."""
        for waiting in self._waiting:
            waiting.cancel()
        self._waiting.clear()
        self._thread.submit(self._end).result()
        if not self._path.exists():
            return False
        self._path.unlink()
        return True

    def close(self) -> None:
        """Finish the file; may be called twice."""
        self._thread.shutdown()
        self._end()
