"""The exit codes of jobs: Hydra passes no results back, and some launchers start processes."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

#: Names the file to which every job of a run adds its exit code; other processes inherit it.
CODES = "MVREG_EXIT_CODES"


@contextmanager
def collected_codes() -> Iterator[list[int]]:
    """Collect the exit codes of the jobs started inside; the list is filled at the end."""
    codes: list[int] = []
    with shared_file() as file:
        with variable(CODES, str(file)):
            yield codes
        if file.exists():
            codes += [int(line) for line in file.read_text().split()]


def add_code(code: int) -> None:
    """Tell whoever collects them; nobody does in a process that outlived its run."""
    if file := os.environ.get(CODES):
        with suppress(OSError), Path(file).open("a") as codes:  # short appends do not mix
            codes.write(f"{code}\n")


@contextmanager
def shared_file() -> Iterator[Path]:
    """A file for this process and those that it starts.

    On Linux it is one in memory, of which nothing is left whatever ends the process.
    """
    if hasattr(os, "memfd_create"):
        number = os.memfd_create("mvreg")
        try:
            file = Path(f"/proc/{os.getpid()}/fd/{number}")
            if os.access(file, os.R_OK | os.W_OK):
                yield file
                return
        finally:
            os.close(number)
    with tempfile.TemporaryDirectory(prefix="mvreg-") as folder:
        yield Path(folder) / "codes"


@contextmanager
def variable(name: str, value: str) -> Iterator[None]:
    """Set an environment variable for a while."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        del os.environ[name]
        if before is not None:
            os.environ[name] = before
