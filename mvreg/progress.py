"""How far a registration is, for a program that waits for it; and how it is called off."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.errors import MvregError
from mvreg.events import (
    AdjustStarted,
    Emit,
    Event,
    PairRegistered,
    PairStarted,
    PosesRevised,
    ReferenceChosen,
    ViewPlaced,
    ViewPrepared,
)
from mvreg.types import Array, Pair, Result, View


@dataclass(frozen=True, eq=False)
class Progress:
    """How far a registration is; what `mvreg.register` calls its `progress` with.

    Parameters
    ----------
    step : str
        ``prepare``, ``register``, then ``adjust``.
    text : str
        What is under way: ``registering a -> b``.
    done, total : int
        Of the scans so many are prepared, and from ``register`` on placed in a model, the
        reference's or another. It may become less: poses that later evidence contradicts are
        withdrawn.
    pairs : int
        So many pairs have been attempted.
    seconds : float
        Since the call of `mvreg.register`.
    so_far : callable
        The `Result` of what is placed by now, before the poses are adjusted; None before the first.
        It is made when it is called.
    """

    step: str
    text: str
    done: int
    total: int
    pairs: int
    seconds: float
    so_far: Callable[[], Result | None]


#: Is told how far a registration is; what it answers is ignored, except for False: "stop".
Listener = Callable[[Progress], object]


class CancelledError(MvregError):
    """A registration was called off by its `progress`, which answered False.

    `result` is what was placed by then, as `Progress.so_far` gives it: with the scans that were not
    placed yet among its `unregistered`; None where there was nothing.
    """

    def __init__(self, result: Result | None) -> None:
        placed = "no scan" if result is None else f"{len(result.poses)} scans"
        super().__init__(
            f"the registration was called off by its progress function; {placed} placed by then"
        )
        self.result = result


class Stop(BaseException):
    """Ends a registration from within an event, past whatever stages catch.

    `cause` is what the listener raised, None where it answered False.
    """

    def __init__(self, cause: BaseException | None) -> None:
        super().__init__()
        self.cause = cause


class SoFar:
    """What is placed by now, as the events of a run tell it."""

    def __init__(self) -> None:
        self.views: list[View] = []
        self.reference: str | None = None
        self.poses: dict[str, Array] = {}
        self.components: tuple[Mapping[str, Array], ...] = ()
        self.pairs: list[Pair] = []

    def __call__(self, event: Event) -> None:
        """Take an event into account."""
        match event:
            case ViewPrepared():
                self.views.append(event.view)
            case ReferenceChosen():
                self.reference = event.model.members[0]
                self.poses = {self.reference: np.eye(4)}
            case PairRegistered():
                self.pairs.append(event.pair)
            case PosesRevised():
                self._revise(event.reference, event.poses, event.components)
            case AdjustStarted():
                found = event.result
                self._revise(found.reference, found.poses, found.components)
            case ViewPlaced():
                self.poses[event.name] = event.T_model_scan
                self.components = without(event.name, self.components)

    def _revise(
        self,
        reference: str,
        poses: Mapping[str, Array],
        components: tuple[Mapping[str, Array], ...],
    ) -> None:
        self.reference, self.poses, self.components = reference, dict(poses), components

    @property
    def placed(self) -> int:
        """How many scans are in a model."""
        return len(self.poses) + sum(map(len, self.components))

    def result(self, names: Iterable[str]) -> Result | None:
        """What is placed by now of the scans with these names; None before there is a reference."""
        if self.reference is None:
            return None
        placed = self.poses.keys() | {name for poses in self.components for name in poses}
        missing = tuple(name for name in names if name not in placed)
        return Result(
            self.reference, dict(self.poses), missing, tuple(self.pairs),
            components=self.components, views=tuple(self.views),
        )  # fmt: skip


def without(
    name: str, components: Iterable[Mapping[str, Array]]
) -> tuple[Mapping[str, Array], ...]:
    """The partial models without a scan that has come into the reference's."""
    left = ({other: pose for other, pose in poses.items() if other != name} for poses in components)
    return tuple(poses for poses in left if poses)


class Reporter:
    """Passes events on, and after each tells a listener how far the run is."""

    def __init__(self, listener: Listener, names: Sequence[str], emit: Emit) -> None:
        self.listener, self.names, self.emit = listener, names, emit
        self.started = time.perf_counter()
        self.known = SoFar()
        self.step, self.text = "prepare", "down-sampling"

    def __call__(self, event: Event) -> None:
        """Pass an event on, and tell of it."""
        self.emit(event)
        self.known(event)
        match event:
            case ViewPrepared():
                self.text = f"prepared {event.view.name}"
            case ReferenceChosen() | PosesRevised():
                self.step, self.text = "register", "looking for pairs"
            case PairStarted():
                self.step = "register"
                self.text = f"registering {event.source.name} -> {event.target.name}"
            case PairRegistered():
                self.text = f"registered {event.pair.source} -> {event.pair.target}"
            case ViewPlaced():
                self.text = f"placed {event.name}"
            case AdjustStarted():
                self.step, self.text = "adjust", "adjusting all poses"
        self.tell()

    def tell(self) -> None:
        """Call the listener.

        Raises
        ------
        Stop
            If it wants no more.
        """
        done = len(self.known.views) if self.step == "prepare" else self.known.placed
        now = Progress(
            self.step, self.text, done, len(self.names), len(self.known.pairs),
            time.perf_counter() - self.started, self.so_far,
        )  # fmt: skip
        try:
            answer = self.listener(now)
        except BaseException as cause:
            raise Stop(cause) from None
        if isinstance(answer, bool | np.bool_) and not answer:
            raise Stop(None)

    def so_far(self) -> Result | None:
        """What is placed by now."""
        return self.known.result(self.names)
