"""The tables of a benchmark, for the screen and for the page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from experiments.bench.child import STAGES
from experiments.bench.numbers import Growth, growth, ratio
from experiments.bench.plan import PEERS
from experiments.bench.records import Record
from experiments.report.tables import number, public
from mvreg.report.comparison.spread import Spread, spread

#: What is drawn and fitted over the size, in the answers and in words.
COSTS = {"seconds": "time (s)", "pairs_per_scan": "pairs / N", "peak_mb": "peak memory (MB)"}


#: Variants of a micro-benchmark that the others are compared with.
REFERENCES = ("reference", "scipy")


@dataclass(frozen=True)
class Table:
    """Headings and rows; the first `left` columns are words."""

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    left: int = 1


Groups = dict[tuple[str, str], list[Record]]


def grouped(records: Iterable[Record]) -> Groups:
    """The rounds of each case, by its group and row, in the order of their first appearance."""
    found: Groups = {}
    for record in records:
        found.setdefault((record.group, record.row), []).append(record)
    return found


def of(records: Sequence[Record] | None, name: str) -> Spread | None:
    """A number of the answers; "wall" is the process's own time."""
    rows = records or []
    if name == "wall":
        return spread(r.wall for r in rows if r.error is None)
    if name == "pairs_per_scan":
        return spread(r.answer["pairs"] / r.answer["scans"] for r in rows if r.answer is not None)
    return spread(r.value(name) for r in rows)


def shown(found: Spread | None, form: str) -> str:
    """Median and extremes, or nothing."""
    return "" if found is None else found.shown(form)


def middle(found: Spread | None, form: str) -> str:
    """The median, or nothing."""
    return "" if found is None else format(found.median, form)


def placed(records: Sequence[Record]) -> str:
    """How many scans have a place, or in a word why there is none; of several runs the fewest."""
    answers = [r.answer for r in records if r.answer is not None]
    if not answers:
        return "*too long*" if records[-1].too_long else "*failed*"
    least = min(answers, key=lambda answer: int(answer["placed"]))
    return f"{least['placed']} of {least['scans']}"


def false_positives(records: Sequence[Record]) -> str:
    """The largest number of false positives."""
    known = [r.answer["false"] for r in records if r.answer and r.answer["false"] is not None]
    return str(max(known)) if known else ""


def methods(records: Sequence[Record]) -> Table:
    """Times, errors and ratios of the methods on real scans."""
    groups = grouped(records)
    peers = [peer for peer in PEERS if any(row == peer for _, row in groups)]
    rows = []
    for (group, row), runs in sorted(groups.items(), key=lambda each: order(groups, each[0])):
        seconds = of(runs, "seconds")
        beside = [ratio(of(groups.get((group, peer)), "seconds"), seconds) for peer in peers]
        rows.append([
            group, row, placed(runs), false_positives(runs), middle(of(runs, "pairs"), ".0f"),
            middle(of(runs, "rotation"), ".4f"), middle(of(runs, "translation"), ".3f"),
            middle(of(runs, "load"), ".2f"), shown(seconds, ".2f"),
            *(number(each, ".2f") for each in beside), middle(of(runs, "peak_mb"), ".0f"),
            str(sum(r.answer is not None for r in runs)),
        ])  # fmt: skip
    heads = ["data set", "method", "placed", "false", "pairs", "e_R", "e_t (mm)", "loading (s)",
             "time (s)", *(f"{peer} takes times" for peer in peers), "peak memory (MB)",
             "runs"]  # fmt: skip
    return Table("Methods and peers", heads, rows, 3)


def order(groups: Groups, key: tuple[str, str]) -> tuple[int, int]:
    """Data sets and methods as they first came up; the turns must not show."""
    sets, names = ([*dict.fromkeys(each[i] for each in groups)] for i in (0, 1))
    return sets.index(key[0]), names.index(key[1])


def stages(records: Sequence[Record]) -> Table:
    """Time per stage of mvreg's own methods, medians."""
    rows = []
    groups = grouped(r for r in records if r.row not in PEERS and r.answer is not None)
    for (group, row), runs in sorted(groups.items(), key=lambda each: order(groups, each[0])):
        found = [spread((r.answer or {})["stages"].get(stage) for r in runs)
                 for stage in (*STAGES, "other")]  # fmt: skip
        cells = [middle(each, ".3f") for each in (*found, of(runs, "seconds"))]
        rows.append([group, row, *cells])
    return Table("Time per stage (s)", ["data set", "method", *STAGES, "other", "all"], rows, 2)


def start(records: Sequence[Record]) -> Table:
    """Whole commands."""
    rows = [
        [row, shown(of(runs, "wall"), ".2f"), str(sum(r.error is None for r in runs))]
        for (_, row), runs in grouped(records).items()
    ]
    return Table("From the start to the prompt", ["command", "time (s)", "runs"], rows)


def sizes(records: Sequence[Record], title: str, head: str) -> Table:
    """How a cost grows: a row for each method and size."""
    rows = []
    groups = grouped(records)
    for (_, row), runs in sorted(groups.items(), key=lambda e: (e[0][1], e[1][0].size)):
        rows.append([
            row, f"{runs[0].size:,}", placed(runs), false_positives(runs),
            middle(of(runs, "pairs_per_scan"), ".2f"), shown(of(runs, "seconds"), ".1f"),
            middle(of(runs, "held_mb"), ".0f"), middle(of(runs, "peak_mb"), ".0f"),
        ])  # fmt: skip
    heads = ["method", head, "placed", "false", "pairs / N", "time (s)", "loaded (MB)",
             "peak memory (MB)"]  # fmt: skip
    return Table(title, heads, rows)


def fitted(records: Sequence[Record], row: str, cost: str) -> Growth | None:
    """How a cost of one method grows with the size."""
    known = sorted(
        (runs[0].size, found.median)
        for (_, name), runs in grouped(records).items()
        if name == row and (found := of(runs, cost)) is not None
    )
    return growth([size for size, _ in known], [value for _, value in known])


def exponents(records: Sequence[Record]) -> Table:
    """The exponents of all costs: over all sizes, and between the largest two."""
    rows = []
    for row in sorted({r.row for r in records}):
        cells = [row]
        for cost in COSTS:
            found = fitted(records, row, cost)
            cells += ["", ""] if found is None else [f"{found.exponent:z.2f}", f"{found.last:z.2f}"]
        rows.append(cells)
    heads = [text for head in COSTS.values() for text in (head.split(" (")[0], "at the end")]
    return Table("Fitted exponents", ["method", *heads], rows)


def kernels(records: Sequence[Record]) -> Table:
    """The micro-benchmarks; variants beside the reference of their group, where there is one."""
    found = (records[-1].answer or {}).get("benchmarks", []) if records else []
    slow = {each["group"]: each["median"] for each in found if variant(each) in REFERENCES}
    rows = []
    for each in found:
        beside = slow[each["group"]] / each["median"] if each["group"] in slow else None
        rows.append([
            each["group"], variant(each), f"{1e3 * each['median']:.3f}",
            f"{1e3 * each['min']:.3f}", str(each["rounds"]), number(beside, ".1f"),
        ])  # fmt: skip
    heads = ["what", "variant", "median (ms)", "least (ms)", "rounds", "reference takes times"]
    return Table("Kernels", heads, rows, 2)


def variant(benchmark: Mapping[str, Any]) -> str:
    """What stands in the brackets of a benchmark's name."""
    return str(benchmark["name"]).partition("[")[2].rstrip("]")


def gaps(records: Sequence[Record]) -> list[str]:
    """Why something has no answer, a line for each case."""
    return [
        f"- {r.part}, {r.group}, {r.row}: {public(r.error)}"
        for runs in grouped(records).values()
        if (r := runs[-1]).error is not None
    ]
