"""A benchmark on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from experiments.bench.records import Record, latest
from experiments.bench.tables import Table, exponents, gaps, kernels, methods, sizes, stages, start
from experiments.report.bench_bars import bars

if TYPE_CHECKING:
    from rich.console import Console


def tables(records: Sequence[Record], part: str) -> list[Table]:
    """What there is to say of the records of one part; no table is empty."""
    return [table for table in every(records, part) if table.rows]


def every(records: Sequence[Record], part: str) -> list[Table]:
    """The tables of a part."""
    match part:
        case "methods":
            return [methods(records), stages(records)]
        case "start":
            return [start(records)]
        case "micro":
            return [kernels(records)]
        case "scans":
            return [sizes(records, "Number of scans", "scans"), exponents(records)]
        case _:
            return [sizes(records, "Points per scan", "points"), exponents(records)]


def show(records: Sequence[Record], parts: Sequence[str], console: Console) -> None:
    """Print the tables of some parts, and whether the bars are reached."""
    for part in parts:
        own = latest(records, part)
        for table in tables(own, part) if own else []:
            console.print(drawn(table))
        for line in gaps(own):
            console.print(line, style="red", markup=False, highlight=False)
    console.print(drawn(bars(records)))


def drawn(table: Table) -> object:
    """A table as rich draws it."""
    from rich.table import Table as Drawn

    found = Drawn(title=table.title, title_justify="left")
    for place, head in enumerate(table.heads):
        left = place < table.left
        found.add_column(head, justify="left" if left else "right", overflow="fold")
    for row in table.rows:
        found.add_row(*row)
    return found
