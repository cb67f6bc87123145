"""What comes out of an attempt, as it can be kept and sent: plain records."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from mvreg.events import Event
from mvreg.types import Array, Edge, Matches, Pair, Registration


@dataclass(frozen=True, eq=False)
class Registered:
    """What is kept of a pair-wise registration of an attempt for those who are told of it.

    `source` is a position among the members, as is `target`, the first of those that were merged;
    the registration is without its pairs of points, which are of the merged ones.
    """

    source: int
    target: int
    registration: Registration | None
    pair: Pair


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came out of an attempt.

    Parameters
    ----------
    pairs : tuple of Pair
        Every registration, in order; number `own` is that of the attempt, others closed loops.
    own : int
    joint : Edge or None
        The pose to join the partial models by, in the frame of the first target; None if it was
        refused.
    poses : (C, 4, 4) array
        ``T_target_source`` of a refused attempt that may be right.
    probabilities, plausibilities : (C,) arrays
        How probable each is by itself; and whether or not it can slide.
    registered : tuple of Registered
        The registrations as observers are told of them, in the order in which they ended.
    events : tuple of Event
        What observers are told; empty for an outcome that was kept.
    """

    pairs: tuple[Pair, ...]
    own: int
    joint: Edge | None
    poses: Array
    probabilities: Array
    plausibilities: Array
    registered: tuple[Registered, ...]
    events: tuple[Event, ...] = field(default=(), metadata={"stored": False})


def without_pairs(registration: Registration) -> Registration:
    """A registration without the pairs of points that it rests on."""
    none = Matches.none()
    return replace(registration, pairs=none.indices, distances=none.distances)
