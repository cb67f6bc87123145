"""The comparison of runs as a data frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mvreg.errors import PluginError
from mvreg.report.comparison.runs import find
from mvreg.report.comparison.table import QUANTITIES, tabled


def compare(*runs: str | Path, grouped: bool = True) -> Any:
    """Compare finished runs: a data frame of pandas, as ``mvreg compare`` prints it.

    Parameters
    ----------
    *runs : str or Path
        Run folders, folders with runs below them, and patterns of such.
    grouped : bool
        A row for runs that differ in random numbers and orders only, with medians and in columns
        that end in ``_min`` and ``_max`` the extremes; otherwise a row per run.

    Returns
    -------
    pandas.DataFrame

    Raises
    ------
    InputError
        If there is no finished run in one of the places.
    PluginError
        If pandas is not installed.
    """
    try:
        import pandas as pd
    except ImportError:
        raise PluginError(
            "mvreg.compare needs pandas, which is not installed: pip install 'mvreg[tables]'; "
            "`mvreg compare` works without it"
        ) from None
    found = tabled(find(runs or ["runs"]))
    rows: list[dict[str, object]] = []
    for row in found.rows:
        named = dict(zip(found.columns, row.named, strict=True))
        if not grouped:
            rows += [
                {**named, "folder": str(run.folder), "scans": run.total, **run.values}
                for run in row.runs
            ]
            continue
        cells: dict[str, object] = {"runs": len(row.runs), "scans": row.runs[0].total}
        for quantity, cell in zip(QUANTITIES, row.cells, strict=True):
            names = (f"{quantity.name}{end}" for end in ("", "_min", "_max"))
            cells |= dict(zip(names, cell.ends, strict=True))
        rows.append({**named, **cells})
    return pd.DataFrame(rows)
