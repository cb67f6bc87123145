"""Write a result as ``mvreg export`` writes a run, from a program."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mvreg.export.run import export
from mvreg.export.table import formats_of
from mvreg.report.of_result import report_of
from mvreg.types import Result, ScanSet


def write(
    result: Result, folder: str | Path, formats: Sequence[str], scans: ScanSet | None = None
) -> list[str]:
    """Write poses and points in the formats of other programs.

    Parameters
    ----------
    result : Result
        Of `mvreg.register`.
    folder : str or Path
        Made if it is missing. The reference's model is here, others in ``component_2``, and so on.
    formats : sequence of str
        ``["ply", "tum"]``; ``mvreg export --list`` has them.
    scans : ScanSet, optional
        What was registered, where it knows more than the result: the unit, the files.

    Returns
    -------
    list of str
        What is to be said: scans without a pose, what a format could not keep.

    Raises
    ------
    InputError
        If there is no such format or what it needs is not installed, the result does not have its
        views, or a file cannot be written.
    PluginError
        If a plugin's format fails; the other formats are written.
    """
    wanted = formats_of([formats] if isinstance(formats, str) else formats)
    registered, report = report_of(result, scans, "mvreg.write")
    return export(report, wanted, Path(folder), lambda: registered, lambda _: result.views)
