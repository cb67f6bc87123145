"""Progress on the screen during a run, and the table at its end."""

from __future__ import annotations

import io
import sys
from multiprocessing import parent_process
from typing import TYPE_CHECKING, TextIO

from mvreg.events import (
    AdjustStarted,
    Event,
    PairStarted,
    PosesRevised,
    ReferenceChosen,
    RunFinished,
    RunStarted,
    ViewPlaced,
    ViewPrepared,
)
from mvreg.plugins.hookspecs import hookimpl
from mvreg.report.input_rows import opening_lines
from mvreg.report.table import open_console, render

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn, TaskID

__all__ = ["Console", "render"]


class Console:
    """Shows progress on standard error and the final table on standard output; one per run.

    Where standard error is no terminal, two plain lines replace the bar; and so they do in a
    process that a launcher started, because there other runs write to the same terminal.

    Parameters
    ----------
    out, err : text file, optional
        Standard output and standard error if not given.
    """

    def __init__(self, out: TextIO | None = None, err: TextIO | None = None) -> None:
        self._out = out
        self._err = err or sys.stderr
        self._bar: Progress | None = None
        self._task: TaskID | None = None
        self._run: RunStarted | None = None
        self._prepared = 0
        self._placed: set[str] = set()
        self._attempts = 0

    @hookimpl
    def mvreg_event(self, event: Event) -> None:
        """Show one event."""
        match event:
            case RunStarted():
                self._run = event
                for line in opening_lines(event.scanset):
                    self._err.write(f"{line}\n")
                self._open(len(event.scanset.scans))
                self._say(f"{event.scanset.name}: {len(event.scanset.scans)} scans, {event.method}")
                self._show_preparing()
            case ViewPrepared():
                self._prepared += 1
                self._show_preparing()
            case ReferenceChosen():
                self._placed.update(event.model.members)
            case PairStarted():
                if not self._attempts:
                    self._begin_stage()
                    self._say(f"prepared {self._prepared} scans, registering")
                self._attempts += 1
                pair = f"{event.source.name} -> {event.target.name}"
                self._show(f"registering {pair} (pair {self._attempts}), placed", len(self._placed))
            case ViewPlaced():
                self._placed.add(event.name)
                self._show(f"placed {event.name}; in all", len(self._placed))
            case PosesRevised():
                self._placed = set(event.poses)
                self._show(revised(event), len(self._placed))
            case AdjustStarted():
                self._show("adjusting the poses of", len(event.result.poses))
            case RunFinished():
                self.close()
                self._tell(event)

    def close(self) -> None:
        """Take the bar away; may be called twice."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def _tell(self, event: RunFinished) -> None:
        folder = self._run.folder if self._run else None
        if parent_process() is None:
            render(event.report, folder, self._out)
            return
        text = io.StringIO()
        render(event.report, folder, text)
        out = self._out or sys.stdout
        out.write(text.getvalue())  # at once, not mixed with the lines of other runs
        out.flush()

    def _open(self, total: int) -> None:
        if not self._err.isatty() or parent_process() is not None:
            return
        from rich import progress

        self._bar = progress.Progress(
            progress.TextColumn("{task.description}", markup=False),
            progress.BarColumn(),
            progress.MofNCompleteColumn(),
            progress.TimeElapsedColumn(),
            _time_left_column(),
            console=open_console(self._err),
            transient=True,
            speed_estimate_period=300.0,
        )
        self._task = self._bar.add_task("", total=total)
        self._bar.start()

    def _show_preparing(self) -> None:
        scans = self._run.scanset.scans if self._run else ()
        if self._prepared < len(scans):
            self._show(f"preparing {scans[self._prepared].name}", self._prepared)

    def _show(self, text: str, done: int) -> None:
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=text, completed=done)

    def _begin_stage(self) -> None:
        """Forget how fast the stage before was: it says nothing of the next."""
        if self._bar is not None and self._task is not None:
            self._bar.reset(self._task, completed=0)

    def _say(self, line: str) -> None:
        """A plain line where there is no bar."""
        if self._bar is None:
            self._err.write(f"{line}\n")
            self._err.flush()


def _time_left_column() -> ProgressColumn:
    """The time left at the speed so far; nothing where that is not known, or all are placed."""
    from datetime import timedelta

    from rich.progress import ProgressColumn, Task
    from rich.text import Text

    class TimeLeft(ProgressColumn):
        max_refresh = 0.5

        def render(self, task: Task) -> Text:
            seconds = task.time_remaining
            if not seconds:
                return Text("")
            return Text(f"about {timedelta(seconds=int(seconds))} left", style="cyan")

    return TimeLeft()


def revised(event: PosesRevised) -> str:
    """What the bar says of partial models: how many scans stand in others than the reference's."""
    apart = sum(len(poses) for poses in event.components)
    if not apart:
        return "joined into one model:"
    parts = len(event.components)
    return f"{apart} scans in {parts} other part{'' if parts == 1 else 's'}, joined to the first:"
