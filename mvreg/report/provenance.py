"""Provenance of a result: the code's commit and the machine, with nothing private."""

from __future__ import annotations

import os
import platform
import subprocess
from functools import cache
from pathlib import Path

from mvreg.parallel import threads

#: What a commit must differ in for a result to differ; documents and results do not count.
CODE = ("mvreg", "conf", "plugins", "pyproject.toml")


@cache
def commit() -> str | None:
    """The commit of the checkout that mvreg runs from, with "-changed" where its code was changed.

    None where mvreg was installed from a wheel, or git is missing. Asked once per process, because
    that is when the code was read.
    """
    checkout = Path(__file__).resolve().parents[2]
    if not (checkout / ".git").exists():  # some other project's, if any, that holds us
        return None
    found = git(checkout, "rev-parse", "--short=12", "HEAD")
    if found is None:
        return None
    clean = git(checkout, "diff", "--quiet", "HEAD", "--", *CODE) is not None
    return found if clean else f"{found}-changed"


def git(folder: Path, *words: str) -> str | None:
    """What git answers; None where it fails or is missing."""
    try:
        done = subprocess.run(
            ["git", *words], cwd=folder, capture_output=True, text=True, timeout=20, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


def machine() -> dict[str, object]:
    """CPU model, cores, threads used, operating system; no host name, no user, no paths."""
    return {
        "cpu": cpu(),
        "cores": os.cpu_count() or 1,
        "threads": threads(),
        "system": f"{platform.system()} {platform.machine()}",
    }


def cpu() -> str:
    """The model of the processor, as far as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return next(iter(models), "") or platform.processor() or platform.machine()
