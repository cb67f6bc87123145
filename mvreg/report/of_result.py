"""The report of a result that a program has, which no run folder keeps."""

from __future__ import annotations

from mvreg.errors import InputError
from mvreg.report.build import build_report
from mvreg.types import Result, ScanSet


def report_of(
    result: Result, scans: ScanSet | None, caller: str
) -> tuple[ScanSet, dict[str, object]]:
    """The scans that were registered, and the report.

    Parameters
    ----------
    result : Result
        Of `mvreg.register`.
    scans : ScanSet or None
        What was registered; None for what the result's views keep of it.
    caller : str
        For messages.

    Raises
    ------
    InputError
        If the result does not have its views.
    """
    if not result.views:
        raise InputError(
            f"{caller}: expected a result with its views, as mvreg.register returns it, found none"
        )
    if scans is None:
        scans = ScanSet("scans", tuple(view.scan for view in result.views if view.scan))
    report = build_report(
        scans, result.views, result, method="register", rng=None, seconds={}, config={}
    )
    return scans, report
