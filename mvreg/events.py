"""The events of a run, as frozen records; observers receive them through `mvreg_event`.

One event per scan and per pair, never per iteration. Observers must not change what they are given.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from mvreg.types import Array, Candidates, Matches, Model, Pair, Registration, Result, ScanSet, View

__all__ = [
    "AdjustStarted",
    "Emit",
    "Event",
    "PairRegistered",
    "PairStarted",
    "PosesRevised",
    "ReferenceChosen",
    "RunFinished",
    "RunStarted",
    "ViewPlaced",
    "ViewPrepared",
    "ignore",
]


@dataclass(frozen=True, eq=False)
class RunStarted:
    """The scans are loaded; `folder` is where the run's files go, None for a library call."""

    scanset: ScanSet
    method: str
    folder: Path | None = None


@dataclass(frozen=True, eq=False)
class ViewPrepared:
    """Scan number `index` of `total` is down-sampled and described.

    `seconds` maps stages to time; all the scans' down-sampling is with the first.
    """

    view: View
    index: int
    total: int
    seconds: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class ReferenceChosen:
    """The model begins with this view; its frame is the model frame."""

    model: Model


@dataclass(frozen=True, eq=False)
class PairStarted:
    """A pair-wise registration begins."""

    source: View
    target: View


@dataclass(frozen=True, eq=False)
class PairRegistered:
    """A pair-wise registration ended: with what it found, and how it was judged.

    One that was found in the store, see `mvreg.store`, or that another process has worked on, is
    told in short: without matches and candidates, the registration without its pairs of points,
    and the first of several merged targets stands for all.
    """

    source: View
    target: View
    seeds: Matches
    candidates: Candidates
    registration: Registration | None
    pair: Pair


@dataclass(frozen=True, eq=False)
class ViewPlaced:
    """A view has a pose, `T_model_scan` (4, 4), and the model has grown, where there is one."""

    name: str
    T_model_scan: Array
    model: Model | None = None
    seconds: float = 0.0


@dataclass(frozen=True, eq=False)
class PosesRevised:
    """All that is placed by now, for strategies that join partial models, or take poses back.

    It replaces whatever was told before. Fields as those of `Result`.
    """

    reference: str
    poses: Mapping[str, Array]
    components: tuple[Mapping[str, Array], ...] = ()


@dataclass(frozen=True, eq=False)
class AdjustStarted:
    """The loop has ended with `result`; now all its poses are improved at once."""

    result: Result


@dataclass(frozen=True, eq=False)
class RunFinished:
    """The poses are final; `report` is what ``result.json`` holds."""

    scanset: ScanSet
    result: Result
    report: dict[str, object]


Event = (
    RunStarted
    | ViewPrepared
    | ReferenceChosen
    | PairStarted
    | PairRegistered
    | ViewPlaced
    | PosesRevised
    | AdjustStarted
    | RunFinished
)
Emit = Callable[[Event], None]


def ignore(event: Event) -> None:
    """The observer that looks away."""
