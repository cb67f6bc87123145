"""How a claim is checked on our numbers: it holds, does not hold, or was not measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from experiments.common.runs import Run
from experiments.report.measured import Measured, measured
from experiments.report.printed import Printed

#: One data set or order: whether the claim holds there, and the numbers; None if not measured.
Case = tuple[bool, str] | None
Jobs = Mapping[str, Mapping[str, Run]]


@dataclass(frozen=True)
class Claim:
    """A sentence, and what was found in each of its cases."""

    text: str
    cases: Mapping[str, Case]

    @property
    def verdict(self) -> str:
        """It holds where it holds in every case that was measured."""
        found = [case[0] for case in self.cases.values() if case is not None]
        if not found:
            return "not measured"
        return "holds" if all(found) else "does not hold"

    def __str__(self) -> str:
        """One item of a list; what goes against the claim is in italics."""
        if self.verdict == "not measured":
            return f"- **{self.verdict}**: {self.text}."
        shown = []
        for name, case in self.cases.items():
            if case is None:
                shown.append(f"{name} not measured")
            else:
                shown.append(f"{name} {case[1]}" if case[0] else f"*{name} {case[1]}*")
        return f"- **{self.verdict}**: {self.text}: {'; '.join(shown)}."


def each(runs: Jobs, check: Callable[[Mapping[str, Run]], Case]) -> dict[str, Case]:
    """The cases of a claim, one for each data set."""
    return {name: check(methods) for name, methods in runs.items()}


def placed(methods: Sequence[str]) -> Callable[[Mapping[str, Run]], Case]:
    """Each of these methods places every scan, without false positives."""

    def check(found: Mapping[str, Run]) -> Case:
        shown, good, known = [], True, False
        for name in methods:
            if name not in found or found[name].report is None:
                shown.append(f"{name} not measured")
                continue
            now = measured(found[name])
            good, known = good and now.complete and not now.false, True
            shown.append(f"{name} {now.placed} of {now.total}, {now.false or 0} false positives")
        return (good, "(" + "; ".join(shown) + ")") if known else None

    return check


def no_worse(
    methods: Sequence[str],
    printed: Callable[[Run], Printed | None],
    factor: float,
) -> Callable[[Mapping[str, Run]], Case]:
    """e_R and e_t are at most `factor` times the printed ones."""

    def check(found: Mapping[str, Run]) -> Case:
        shown, good = [], True
        for name in methods:
            theirs = printed(found[name]) if name in found else None
            if theirs is None or found[name].report is None:
                continue
            now = measured(found[name])
            ratios = now.rotation / theirs.rotation, now.translation / theirs.translation
            good &= now.complete and max(ratios) <= factor
            shown.append(f"{name} {ratios[0]:.2f} and {ratios[1]:.2f}")
        return (good, "(" + ", ".join(shown) + ")") if shown else None

    return check


def rising(
    methods: Sequence[str], measure: Callable[[Run], float], form: str = ".0f"
) -> Callable[[Mapping[str, Run]], Case]:
    """A number is larger for each method than for the one before; of complete runs only."""

    def check(found: Mapping[str, Run]) -> Case:
        if not all(name in found and measured(found[name]).complete for name in methods):
            return None
        values = [measure(found[name]) for name in methods]
        good = all(a < b for a, b in pairwise(values))
        shown = [f"{n} {v:{form}}" for n, v in zip(methods, values, strict=True)]
        return good, "(" + ", ".join(shown) + ")"

    return check


def pairs(
    method: str, wanted: Callable[[float, int], bool], name: str, bound: Callable[[int], int]
) -> Callable[[Mapping[str, Run]], Case]:
    """The number of pair-wise registrations is as wanted beside a bound, under its name."""

    def check(found: Mapping[str, Run]) -> Case:
        now = measured(found[method]) if method in found else Measured()
        if not now.total:
            return None
        limit = bound(now.total)
        return wanted(now.pairs, limit), f"{now.pairs:.0f} ({name} = {limit})"

    return check


def seconds(run: Run) -> float:
    """The time that a run took, without loading."""
    return measured(run).seconds


def attempts(run: Run) -> float:
    """The number of pair-wise registrations."""
    return measured(run).pairs


def rotation(run: Run) -> float:
    """e_R."""
    return measured(run).rotation
