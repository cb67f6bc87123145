"""Plots of the runs as SVG: a line per row of the table, a mark per run."""

from __future__ import annotations

from html import escape

from mvreg.report.comparison.table import QUANTITIES, Quantity, Table

#: Widths of the names and of the plot, and the height of a line.
NAMES, WIDE, LINE = 280, 400, 24


def plots(table: Table) -> str:
    """A plot for each quantity that any run has, from zero to the largest value."""
    return "\n".join(filter(None, (_plot(k, one, table) for k, one in enumerate(QUANTITIES))))


def _plot(column: int, quantity: Quantity, table: Table) -> str:
    values = [
        [v for run in row.runs if (v := run.values[quantity.name]) is not None]
        for row in table.rows
    ]
    top = max((value for row in values for value in row), default=0.0)
    if not top > 0:
        return ""
    high = LINE * len(table.rows) + 30
    parts = [
        f'<h2>{quantity.name}</h2><svg viewBox="0 0 {NAMES + WIDE + 80} {high}" role="img" '
        f'aria-label="{quantity.name} of each run">'
    ]
    for k, (row, known) in enumerate(zip(table.rows, values, strict=True)):
        y = LINE * k + 14
        name = " ".join(filter(None, row.named))
        parts.append(f'<text x="0" y="{y + 4}">{escape(name[:44])}</text>')
        parts.append(
            f'<line x1="{NAMES}" x2="{NAMES + WIDE}" y1="{y}" y2="{y}" stroke="#d7dce3"></line>'
        )
        parts += [
            f'<circle cx="{NAMES + WIDE * value / top:.1f}" cy="{y}" r="5" fill="#1f5fbf" '
            f'fill-opacity="0.55"><title>{value:g}</title></circle>'
            for value in known
        ]
        if (median := row.cells[column].median) is not None:
            x = NAMES + WIDE * median / top
            parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y - 9}" y2="{y + 9}" '
                         'stroke="#111" stroke-width="2"></line>')  # fmt: skip
    parts.append(f'<text x="{NAMES}" y="{high - 6}">0</text>')
    parts.append(
        f'<text x="{NAMES + WIDE}" y="{high - 6}" text-anchor="end">{top:.4g}</text></svg>'
    )
    return "".join(parts)
