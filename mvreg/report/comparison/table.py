"""A table over runs: a row for those that differ in random numbers and orders only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mvreg.report.comparison.runs import Told
from mvreg.report.comparison.spread import Spread, spread
from mvreg.report.formatting import unit_name


@dataclass(frozen=True)
class Quantity:
    """A column of the table: `better` is 1 where more is better, -1 where less is."""

    name: str
    better: int
    form: str


QUANTITIES = (
    Quantity("placed", 1, ".0f"), Quantity("false", -1, ".0f"), Quantity("e_R", -1, ".4f"),
    Quantity("e_t", -1, ".4g"), Quantity("consistency", -1, ".4g"),
    Quantity("attempts", -1, ".0f"), Quantity("time", -1, ".2f"),
)  # fmt: skip


@dataclass(frozen=True)
class Cell:
    """A quantity over the runs of a row, None where none has it, and whether it is best."""

    spread: Spread | None
    best: bool = False

    @property
    def median(self) -> float | None:
        """The median over the runs."""
        return self.spread.median if self.spread else None

    @property
    def ends(self) -> tuple[float | None, float | None, float | None]:
        """Median, least and most."""
        found = self.spread
        return (found.median, found.least, found.most) if found else (None, None, None)


@dataclass(frozen=True)
class Row:
    """Runs told apart by random numbers and orders only: `named` has a value for each column."""

    named: tuple[str, ...]
    runs: tuple[Told, ...]
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Table:
    """`columns` name what tells the rows apart; then follow `QUANTITIES`, in `unit`."""

    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    unit: str


def tabled(runs: Sequence[Told]) -> Table:
    """Put runs together that repeat each other, and mark the best of each data set.

    More scans placed are better, then fewer false ones; errors, attempts and times are compared
    among the rows that place most and fewest falsely, lest whoever gives up early wins.
    """
    settings = sorted({key for run in runs for key in run.settings})
    differ = [key for key in settings if len({run.settings.get(key) for run in runs}) > 1]
    groups: dict[tuple[str, ...], list[Told]] = {}
    for run in runs:
        named = (run.dataset, run.method, *(run.settings.get(key, "") for key in differ))
        groups.setdefault(named, []).append(run)
    cells = {named: _cells(group) for named, group in groups.items()}
    rows = [
        Row(named, tuple(groups[named]), _marked(named, cells)) for named in _by_dataset(groups)
    ]
    units = {run.unit for run in runs}
    unit = unit_name(units.pop()) if len(units) == 1 else "unit of the scans"
    return Table(("data set", "method", *differ), tuple(rows), unit)


def _by_dataset(groups: dict[tuple[str, ...], list[Told]]) -> list[tuple[str, ...]]:
    order = list(dict.fromkeys(named[0] for named in groups))
    return sorted(groups, key=lambda named: order.index(named[0]))


def _cells(runs: Sequence[Told]) -> list[Cell]:
    return [Cell(spread(run.values[quantity.name] for run in runs)) for quantity in QUANTITIES]


def _marked(named: tuple[str, ...], cells: dict[tuple[str, ...], list[Cell]]) -> tuple[Cell, ...]:
    rivals = {key: row for key, row in cells.items() if key[0] == named[0]}
    if len(rivals) < 2:
        return tuple(cells[named])
    found = []
    for column, quantity in enumerate(QUANTITIES):
        medians = {key: row[column].median for key, row in rivals.items()}
        known = {key: quantity.better * m for key, m in medians.items() if m is not None}
        top = max(known.values(), default=0.0)
        mine = cells[named][column]
        found.append(Cell(mine.spread, best=known.get(named) == top))
        if quantity.name in ("placed", "false") and known:
            rivals = {key: row for key, row in rivals.items() if known.get(key, top) == top}
    return tuple(found)


def headings(table: Table) -> list[str]:
    """The headings of all columns."""
    units = {"e_t": table.unit, "consistency": table.unit, "time": "s"}
    quantities = [
        f"{one.name} ({units[one.name]})" if one.name in units else one.name for one in QUANTITIES
    ]
    return [*table.columns, "runs", *quantities]


def texts(row: Row) -> list[str]:
    """The cells of a row as text: the median, and the least and most where they differ."""
    found = [*row.named, str(len(row.runs))]
    for quantity, cell in zip(QUANTITIES, row.cells, strict=True):
        of = f"/{row.runs[0].total}" if quantity.name == "placed" else ""
        found.append(cell.spread.shown(quantity.form, of) if cell.spread else "-")
    return found
