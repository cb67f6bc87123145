"""The table over runs, written: for the terminal, as CSV, Markdown, LaTeX, and HTML."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

from mvreg.report.comparison.plots import plots
from mvreg.report.comparison.table import QUANTITIES, Table, headings, texts

if TYPE_CHECKING:
    from rich.table import Table as Printed

NOTE = (
    "Medians over runs, with the least and the most; best of each data set marked, errors, "
    "attempts and time among the rows that place most and fewest falsely."
)
STYLE = """body { font: 15px/1.5 system-ui, sans-serif; color: #1c2330; margin: 20px auto;
max-width: 1200px; padding: 0 16px; } .wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 14px; } th, td { padding: 4px 9px; text-align: right;
border-bottom: 1px solid #d7dce3; } th { background: #f3f5f8; } .text { text-align: left; }
.best { font-weight: 700; color: #1a6b30; } svg { width: 100%; max-width: 760px; display: block; }
svg text { font: 12px system-ui, sans-serif; fill: #1c2330; } p { color: #4b5563; }"""


def marks(table: Table) -> list[list[tuple[str, bool]]]:
    """All cells as text, and whether each is the best."""
    plain = len(table.columns) + 1
    return [
        [
            (text, k >= plain and row.cells[k - plain].best)
            for k, text in enumerate(texts(row))
        ]
        for row in table.rows
    ]  # fmt: skip


def as_csv(table: Table) -> str:
    """A row per group; median, least and most of each quantity in columns of their own."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    spread = [f"{one.name}{end}" for one in QUANTITIES for end in ("", "_min", "_max")]
    writer.writerow([*table.columns, "runs", "scans", *spread])
    for row in table.rows:
        numbers = [value for cell in row.cells for value in cell.ends]
        told = ["" if value is None else repr(value) for value in numbers]
        writer.writerow([*row.named, len(row.runs), row.runs[0].total, *told])
    return file.getvalue()


def as_markdown(table: Table) -> str:
    """A table of Markdown, the best in bold."""
    rows = [
        [f"**{t}**" if best else t.replace("|", "\\|") for t, best in row] for row in marks(table)
    ]
    lines = markdown(headings(table), rows, len(table.columns))
    return "\n".join(lines) + f"\n\n{NOTE}\n"


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> list[str]:
    """The lines of a table of Markdown; the first `left` columns are aligned left, others right."""
    rules = ["---" if index < left else "---:" for index in range(len(heads))]
    return [f"| {' | '.join(cells)} |" for cells in (heads, rules, *rows)]


def as_latex(table: Table) -> str:
    """A ``tabular`` with the rules of booktabs, the best in bold."""
    shape = "l" * len(table.columns) + "r" * (1 + len(QUANTITIES))
    rows = [
        " & ".join(rf"\textbf{{{tex(t)}}}" if best else tex(t) for t, best in row) + r" \\"
        for row in marks(table)
    ]
    head = " & ".join(map(tex, headings(table))) + r" \\"
    return "\n".join([
        f"% {NOTE}", rf"\begin{{tabular}}{{{shape}}}", r"\toprule", head, r"\midrule", *rows,
        r"\bottomrule", r"\end{tabular}", "",
    ])  # fmt: skip


def tex(text: str) -> str:
    """A text for LaTeX."""
    special = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
    return "".join(special.get(c, f"\\{c}" if c in "&%$#_{}" else c) for c in text)


def as_html(table: Table) -> str:
    """A page with the table and a plot per quantity, complete in itself."""
    heads = "".join(
        f"<th{_text(k, table)}>{escape(head)}</th>" for k, head in enumerate(headings(table))
    )
    rows = "\n".join(
        "<tr>" + "".join(
            f"<td{' class=best' if best else _text(k, table)}>{escape(text)}</td>"
            for k, (text, best) in enumerate(row)
        ) + "</tr>"
        for row in marks(table)
    )  # fmt: skip
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>Runs compared</title><style>{STYLE}</style></head><body>\n"
        f"<h1>Runs compared</h1><p>{NOTE}</p>\n<div class=wide><table>"
        f"<thead><tr>{heads}</tr></thead><tbody>\n{rows}\n</tbody></table></div>\n{plots(table)}\n</body></html>\n"
    )


def _text(column: int, table: Table) -> str:
    return " class=text" if column < len(table.columns) else ""


#: The writers of text, by the format's name; the terminal has a table of its own.
FORMATS: dict[str, Callable[[Table], str]] = {
    "csv": as_csv, "markdown": as_markdown, "latex": as_latex, "html": as_html,
}  # fmt: skip
ENDINGS = {".csv": "csv", ".md": "markdown", ".tex": "latex", ".html": "html"}


def printed(table: Table) -> Printed:
    """The table for the terminal."""
    from rich import box
    from rich.table import Table as Printed
    from rich.text import Text

    found = Printed(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, caption=NOTE)
    for k, head in enumerate(headings(table)):
        found.add_column(head.replace(" (", "\n("), vertical="bottom",
                         justify="left" if k < len(table.columns) else "right")  # fmt: skip
    for row in marks(table):
        found.add_row(
            *(Text(f"{t} *" if best else t, "bold green" if best else "") for t, best in row)
        )
    return found
