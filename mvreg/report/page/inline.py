"""The page of a result inside a notebook."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

from mvreg.types import Result, ScanSet


@dataclass(frozen=True)
class Shown:
    """A page, `html`, complete in itself; notebooks draw it `height` pixels high."""

    html: str
    height: int = 900

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{escape(self.html)}" style="width: 100%; height: {self.height}px; '
            'border: 1px solid #d7dce3" title="registration report"></iframe>'
        )

    def __repr__(self) -> str:
        return f"<the page of a registration, {len(self.html) / 1e6:.1f} MB; its text is in .html>"


def show(result: Result, scans: ScanSet | None = None, height: int = 900) -> Shown:
    """Show a result: the scans in three dimensions, and what is known of each.

    Parameters
    ----------
    result : Result
        Of `mvreg.register`.
    scans : ScanSet, optional
        What was registered, where it knows more than the result: the unit, a ground truth.
    height : int
        Of the frame in a notebook (pixels).

    Returns
    -------
    Shown
        A notebook draws it as the value of a cell; ``.html`` is the text of the page.

    Raises
    ------
    InputError
        If the result does not have its views.
    """
    from mvreg.report.of_result import report_of
    from mvreg.report.page.data import page_data
    from mvreg.report.page.render import render_page

    scans, report = report_of(result, scans, "mvreg.show")
    return Shown(render_page(page_data(report, scans, result.views)), height)
