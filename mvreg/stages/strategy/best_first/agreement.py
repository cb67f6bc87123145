"""Hypotheses of view pairs, and loops of them that agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mvreg.evidence.calibration import LOOP_CHANCE
from mvreg.types import Array

#: The probability that a wrong pose agrees with what the other pairs of a loop say; and of one that
#: has rivals a fifth as probable or more, as slides along a corridor have, or that is between the
#: same groups as another one: those agree more often.
CHANCE, CHANCE_OF_RIVALS, RIVAL = LOOP_CHANCE, 0.5, 0.2
#: The exponent of the probability that pairs of a loop of three groups are wrong: 1 if they are
#: wrong independently, a half if together. What looks like one end of a hall to a scan of the other
#: looks so to the scan beside it, too.
APART = 0.7
#: Pairs between two groups, the best two of them, must be as probable by themselves. In offices,
#: whose rooms are nearly symmetric, wrong pairs that agree have 0.35 at most.
LEAST_LIKELY = 0.5


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A relative pose of views `source` and `target`, right with `probability` by itself.

    `attempt` is the position of the pair that it comes from among all attempts; `chance` the
    probability that it would close a loop of three groups if it were wrong.
    """

    source: int
    target: int
    T_target_source: Array
    probability: float
    attempt: int = 0
    chance: float = CHANCE

    @property
    def pair(self) -> frozenset[int]:
        """The views, in no order."""
        return frozenset((self.source, self.target))


@dataclass(frozen=True, eq=False)
class Bundle:
    """Hypotheses of different pairs that agree on how group `ends[0]` lies in `ends[1]`.

    `motion` (4, 4) is ``T_ends1_ends0``, that of the most probable; `against` holds the hypotheses
    of other pairs of views of the same groups that say something else.
    """

    ends: tuple[int, int]
    motion: Array
    members: tuple[Hypothesis, ...]
    against: tuple[Hypothesis, ...]

    @property
    def counted(self) -> list[Hypothesis]:
        """The two most probable: what else agrees with them is not independent.

        In a building that repeats itself many pairs agree on one wrong answer.
        """
        return sorted(self.members, key=lambda one: -one.probability)[:2]

    @property
    def likely(self) -> bool:
        """Whether the members counted are rather right than wrong, in the (geometric) mean.

        What is symmetric agrees on a wrong answer as readily as on the right one, but hardly ever
        makes it more probable than not.
        """
        return bool(self.right ** (1 / len(self.counted)) >= LEAST_LIKELY)

    @property
    def right(self) -> float:
        """The probability that the members counted are right, as if they were independent."""
        return float(np.prod([one.probability for one in self.counted]))

    @property
    def wrong(self) -> float:
        """That they are wrong, and agree by chance if there are two.

        They are wrong together, hence the geometric mean: what looks like one end of a hall to a
        scan of the other looks so to the scan beside it.
        """
        wrong = [1 - one.probability for one in self.counted]
        return float(np.prod(wrong) ** (1 / len(wrong)) * CHANCE_OF_RIVALS ** (len(wrong) - 1))

    @property
    def chance(self) -> float:
        """The probability that it closes a loop if it is wrong."""
        return min(one.chance for one in self.members)

    @property
    def contradicted(self) -> float:
        """The probability that everything against the motion is wrong."""
        return float(np.prod([1 - one.probability for one in self.against]))


@dataclass(frozen=True, eq=False)
class Agreement:
    """Bundles that close a loop, and the odds that they are right rather than wrong by chance.

    Of one bundle of two pairs or more the loop runs through the groups; three bundles lead around
    three groups, of which at least two would have to be wrong, and fit, if one is.
    """

    bundles: tuple[Bundle, ...]

    @property
    def odds(self) -> float:
        """Of all being right against the loop closing by chance."""
        right = float(np.prod([bundle.right * bundle.contradicted for bundle in self.bundles]))
        return right / max(self.chance, 1e-300)

    @property
    def chance(self) -> float:
        """The probability that the loop closes although some of it is wrong."""
        if len(self.bundles) == 1:
            return self.bundles[0].wrong
        wrong = [bundle.wrong for bundle in self.bundles]
        right = [bundle.right for bundle in self.bundles]
        two = sum(
            (wrong[a] * wrong[b]) ** APART * right[3 - a - b] for a, b in combinations(range(3), 2)
        )
        chance = max(one.chance for one in self.bundles)
        return float(chance * (two + np.prod(wrong) ** APART))

    @property
    def edges(self) -> list[Hypothesis]:
        """The most probable hypothesis of each bundle; the best two of three bundles join all."""
        best = [max(one.members, key=lambda edge: edge.probability) for one in self.bundles]
        order = sorted(best, key=lambda edge: -edge.probability)
        return order[: max(1, len(order) - 1)]


def against(agreement: Agreement, found: Sequence[Agreement]) -> float:
    """The odds of the best agreement that cannot be right together with this one."""
    own = {bundle.ends: bundle for bundle in agreement.bundles}
    return max(
        (
            other.odds
            for other in found
            if any(own.get(bundle.ends, bundle) is not bundle for bundle in other.bundles)
        ),
        default=0.0,
    )
