"""The paper's claims about each table, and our own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import eq

from experiments.common.runs import Run
from experiments.report.checks import (
    Claim,
    Jobs,
    attempts,
    each,
    no_worse,
    pairs,
    placed,
    rising,
    rotation,
    seconds,
)
from experiments.report.measured import by_dataset
from experiments.report.printed import Printed
from experiments.report.tables import model_points


def table1(runs: Sequence[Run], printed: Callable[[Run], Printed | None]) -> list[Claim]:
    """Table 1 and Fig. 7."""
    sets, own = by_dataset(runs), ("ocpra", "ocpma", "fcpma")
    smaller = rising(("ocpma", "ocpra"), model_points)
    return [
        Claim("every scan is placed, no false positives", each(sets, placed(own))),
        Claim(
            "e_R and e_t are at most 1.25 times those printed (their ratios)",
            each(sets, no_worse(own, printed, 1.25)),
        ),
        Claim(
            "FCPMA is faster than OCPMA, and OCPMA than OCPRA (s)",
            each(sets, rising(("fcpma", "ocpma", "ocpra"), seconds, ".1f")),
        ),
        Claim(
            "FCPMA attempts few more than N - 1 pairs (fewer than twice as many)",
            each(sets, pairs("fcpma", few, "N - 1", lambda n: n - 1)),
        ),
        Claim(
            "merging keeps the model smaller than concatenation does (points)", each(sets, smaller)
        ),
    ]


def table2(runs: Sequence[Run], printed: Callable[[Run], Printed | None]) -> list[Claim]:
    """Table 2, Figs. 8 and 9."""
    sets, others = by_dataset(runs), ("surfc", "spant")
    return [
        Claim("every scan is placed, no false positives", each(sets, placed((*others, "fcpma")))),
        Claim(
            "SurfC's and SpanT's e_R and e_t are no worse than those printed (their ratios)",
            each(sets, no_worse(others, printed, 1.0)),
        ),
        *comparison(sets),
    ]


def table3(runs: Sequence[Run], printed: Callable[[Run], Printed | None]) -> list[Claim]:
    """Table 3: as Table 2, by order."""
    orders: dict[str, dict[str, Run]] = {}
    for run in runs:
        orders.setdefault(f"order {run.value('rng')}", {})[run.value("method")] = run
    three, rest = ("surfc", "spant", "fcpma"), ("ocpra", "ocpma")
    return [
        Claim(
            "every scan is placed in every order, no false positives", each(orders, placed(three))
        ),
        Claim("so it is by OCPRA and OCPMA", each(orders, placed(rest))),
        *comparison(orders),
    ]


def comparison(sets: Jobs) -> list[Claim]:
    """FCPMA against SurfC and SpanT."""
    every, methods = "all N(N - 1)/2", ("fcpma", "spant", "surfc")
    return [
        Claim(
            "FCPMA has a smaller e_R than SpanT", each(sets, rising(methods[:2], rotation, ".4f"))
        ),
        Claim(
            "FCPMA has a smaller e_R than SurfC",
            each(sets, rising(("fcpma", "surfc"), rotation, ".4f")),
        ),
        Claim("FCPMA is faster than SpanT (s)", each(sets, rising(methods[:2], seconds, ".1f"))),
        Claim("SpanT is faster than SurfC (s)", each(sets, rising(methods[1:], seconds, ".1f"))),
        Claim(
            f"SurfC registers {every} pairs",
            each(sets, pairs("surfc", eq, "N(N - 1)/2", lambda n: n * (n - 1) // 2)),
        ),
        Claim(
            "SpanT attempts more pairs than FCPMA and fewer than SurfC",
            each(sets, rising(methods, attempts)),
        ),
    ]


def peers(runs: Sequence[Run], printed: Callable[[Run], Printed | None]) -> list[Claim]:
    """FCPMA and the default method against other systems."""
    sets = by_dataset(runs)
    return [
        Claim(f"{name} places every scan, no false positives", each(sets, placed((name,))))
        for name in dict.fromkeys(run.value("method") for run in runs)
    ]


def few(count: float, tree: int) -> bool:
    """At least the N - 1 edges of a spanning tree, and fewer than twice as many."""
    return tree <= count < 2 * tree
