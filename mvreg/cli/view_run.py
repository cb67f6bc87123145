"""`mvreg view`: look at a finished run with what is there."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path

from mvreg.errors import InputError


def view(arguments: Sequence[str]) -> int:
    """Open the page of a run in a browser, or its recording in rerun where there is no page."""
    parser = argparse.ArgumentParser("mvreg view", description=view.__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="a run folder, by default the newest")
    parser.add_argument(
        "--rerun", action="store_true", help="the recording, even if there is a page"
    )
    found = parser.parse_args(arguments)
    from mvreg.cli.listing import newest

    folder = newest(Path("runs")) if found.folder is None else found.folder
    page, recording = folder / "report.html", folder / "run.rrd"
    if not (page.is_file() or recording.is_file()):
        raise InputError(
            f"{folder}: expected report.html or run.rrd, found neither; mvreg report {folder} "
            "makes the page of a finished run"
        )
    tried = []
    if page.is_file() and not found.rerun:
        if webbrowser.open(page.resolve().as_uri()):
            sys.stdout.write(f"{page}\n")
            return 0
        tried.append(f"no browser could be started: open {page} in one")
    if recording.is_file():
        if viewer := rerun():
            subprocess.Popen([viewer, str(recording)], start_new_session=True)
            sys.stdout.write(f"{recording}\n")
            return 0
        tried.append(f"rerun is not on the path: look at {recording} where it is")
    elif found.rerun:
        tried.append(f"{folder} has no run.rrd: run mvreg with rerun=true")
    raise InputError("; ".join(tried))


def rerun() -> str | None:
    """Rerun's viewer: beside this Python, or on the path."""
    beside = Path(sys.executable).with_name("rerun")
    return str(beside) if beside.is_file() else shutil.which("rerun")
