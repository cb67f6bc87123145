"""Provenance of a result: the code's commit and the machine, with nothing private."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path

from mvreg.parallel import threads

#: What a commit must differ in for a result to differ; documents and results do not count.
CODE = ("mvreg", "conf", "plugins", "pyproject.toml", "setup.py")
#: What can change the answer. Open3D has two distributions, of which one is installed.
DISTRIBUTIONS = (
    "mvreg", "numpy", "scipy", "open3d", "open3d-cpu", "hydra-core", "pluggy", "rerun-sdk",
    "mvreg-comparators", "mvreg-peers", "kiss-matcher", "small-gicp",
)  # fmt: skip


def provenance() -> dict[str, object]:
    """The rows of a report that say what computed it, where and when."""
    return {
        "versions": versions(),
        "commit": commit(),
        "machine": machine(),
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def versions() -> dict[str, str]:
    """Versions of Python and of the distributions that matter; none of them is imported."""
    found = {"python": platform.python_version()}
    for name in DISTRIBUTIONS:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


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
