"""Write the run folder: ``pairs.csv`` as it goes; ``result.json``, poses and models at the end."""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from mvreg.errors import InputError
from mvreg.events import (
    AdjustStarted,
    Event,
    PairRegistered,
    PosesRevised,
    RunFinished,
    RunStarted,
    ViewPlaced,
)
from mvreg.observers.pace import Pace
from mvreg.plugins.hookspecs import hookimpl
from mvreg.progress import SoFar
from mvreg.report.build import build_report, pair_seconds
from mvreg.report.finished import show_run, write_run
from mvreg.report.run_folder import write_placements
from mvreg.types import Pair, Result, ScanSet

COLUMNS = (
    "source", "target", "overlap", "trimmed_mse", "threshold", "verdict", "reason", "seconds",
    "score", "confidence",
)  # fmt: skip


class Recorder:
    """Keeps a run in a folder; one per run.

    Parameters
    ----------
    folder : Path
        Made if it is missing. What an earlier run left there is replaced.
    link : bool
        Let ``latest``, beside the folder, point to it at the end.
    page : bool
        Write ``report.html``, too; of a long run also now and then while it is under way.
    make_room : callable
        Gives up what is worth less than the result where the disk is full; says whether it did.
    """

    def __init__(
        self,
        folder: Path,
        link: bool = True,
        page: bool = False,
        make_room: Callable[[], bool] = lambda: False,
    ) -> None:
        self.folder = folder
        self.link = link
        self.page = page
        self.make_room = make_room
        self._table: TextIO | None = None
        self._started = time.perf_counter()
        self._run: RunStarted | None = None
        self._known = SoFar()
        self._augmenting = 0.0
        self._pace: Pace | None = None

    @hookimpl
    def mvreg_event(self, event: Event) -> None:
        """Write what can be written now, and remember what an interruption would need."""
        self._known(event)
        match event:
            case RunStarted():
                self._start(event)
            case PairRegistered():
                self._append(pair_row(event.pair))
            case ViewPlaced():
                self._augmenting += event.seconds
            case AdjustStarted():
                self._write_placed(event.result)
            case RunFinished():
                self._finish(event.scanset, event.result, event.report)
        if isinstance(event, ViewPlaced | PosesRevised) and self._pace and self._pace.due():
            self._write_so_far(self._pace)

    def finish_interrupted(self, rng: int | None, config: Mapping[str, object]) -> Path | None:
        """Write what was finished before an interruption; ``status`` is then "interrupted".

        Returns
        -------
        Path or None
            The ``result.json``; None if there was no reference yet, and so no pose, or if the run
            is recorded to its end already.
        """
        if (found := self._so_far()) is None:
            self.close()
            return None
        run, result = found
        report = self._report(run, result, rng, config)
        return self._finish(run.scanset, result, report)

    def _so_far(self) -> tuple[RunStarted, Result] | None:
        """The run and what is placed by now; None before a reference, and when all is recorded."""
        if self._run is None:
            return None
        result = self._known.result(scan.name for scan in self._run.scanset.scans)
        return None if result is None else (self._run, result)

    def _report(
        self, run: RunStarted, result: Result, rng: int | None, config: Mapping[str, object]
    ) -> dict[str, object]:
        return build_report(
            run.scanset, self._known.views, result, method=run.method, rng=rng,
            seconds=self._seconds(), config=config, interrupted=True,
        )  # fmt: skip

    def _seconds(self) -> dict[str, float]:
        return {
            **pair_seconds(self._known.pairs),
            "augment": self._augmenting,
            "total": time.perf_counter() - self._started,
        }

    def _write_placed(self, result: Result) -> None:
        """The poses before they are refined; a full disk is for the end of the run to tell."""
        if self._run is not None:
            with suppress(OSError):
                write_placements(self.folder, self._run.scanset, result)

    def _write_so_far(self, pace: Pace) -> None:
        """The page of what is placed by now; a full disk is for the end of the run to tell."""
        if (found := self._so_far()) is None:
            return
        from mvreg.report.page.render import write_page
        from mvreg.report.so_far import report_so_far

        started, (run, result) = time.perf_counter(), found
        report = report_so_far(
            run.scanset, self._known.views, result, method=run.method, seconds=self._seconds()
        )
        with suppress(OSError):
            write_page(self.folder, report, run.scanset, self._known.views)
        pace.written(started)

    def close(self) -> None:
        """Close ``pairs.csv``; may be called twice."""
        if self._table is not None:
            self._table.close()
            self._table = None

    def _start(self, event: RunStarted) -> None:
        self._run = event
        self._started = time.perf_counter()
        self._pace = Pace(len(event.scanset.scans)) if self.page else None
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            # An old answer must not pass for this run's if this run is cut short.
            (self.folder / "result.json").unlink(missing_ok=True)
            (self.folder / "report.html").unlink(missing_ok=True)
            self._table = (self.folder / "pairs.csv").open("w", newline="", encoding="utf-8")
        except OSError as error:
            raise InputError(
                f"cannot write the run folder {self.folder}: {error.strerror or error}; "
                "choose another with hydra.run.dir=DIR"
            ) from None
        self._append(COLUMNS)

    def _append(self, row: Iterable[object]) -> None:
        if self._table is not None:
            csv.writer(self._table, lineterminator="\n").writerow(row)
            self._table.flush()

    def _finish(self, scanset: ScanSet, result: Result, report: Mapping[str, object]) -> Path:
        self.close()
        file = write_run(self.folder, scanset, result, report, self.make_room)
        self._run = None  # an interruption from now on takes nothing away
        show_run(self.folder, scanset, report, self._known.views, self.page, self.link)
        return file


def pair_row(pair: Pair) -> tuple[object, ...]:
    """The row of ``pairs.csv``: lengths in the scans' unit; empty where there was no candidate."""
    found = pair.T_target_source is not None
    return (
        pair.source,
        pair.target,
        _number(pair.overlap),
        _number(pair.trimmed_mse),
        _number(pair.verdict.threshold if found else None),
        "accepted" if pair.verdict.reliable else "rejected",
        pair.verdict.reason,
        f"{sum(pair.seconds.values()):.6f}",
        _number(pair.verdict.score if found else None),
        _number(pair.verdict.confidence),
    )


def _number(value: float | None) -> str:
    """The shortest text that reads back exactly, also for NumPy's numbers."""
    return "" if value is None else repr(float(value))
