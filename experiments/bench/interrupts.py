"""Ctrl-C at random moments: every process must end with 130, and say so in a line.

    python -m experiments.bench.interrupts --moments 200 --busy

Runs the smallest set again and again, alone and as a sweep, and interrupts each process at a moment
drawn at random, from when mvreg's own code begins to when the process ends by itself. With
``--busy`` as many other processes as there are cores compete with it. Prints what it saw, and ends
with 1 if a process ended with another code, or showed a traceback.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

#: What the console script does, with a sign of life when mvreg's own code begins.
START = (
    "import sys; from mvreg.__main__ import main; "
    "open(sys.argv.pop(), 'w').close(); sys.exit(main())"
)
RUN = ("dataset=tiny", "dataset.views=3", "dataset.points=1500")
SWEEP = ("-m", *RUN, "rerun=false", "+method=fcpma,ocpma", "hydra.sweep.dir=sweep")
#: A process that does not end within so many seconds hangs.
LIMIT = 120.0


def started(words: tuple[str, ...], folder: Path) -> subprocess.Popen[str]:
    """A process that has come to mvreg's own code."""
    sign = folder / "sign"
    child = subprocess.Popen(
        [sys.executable, "-c", START, *words, str(sign)], cwd=folder, text=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip
    while not sign.exists() and child.poll() is None:
        time.sleep(0.0005)
    return child


def duration(words: tuple[str, ...]) -> float:
    """The run time of an uninterrupted process (s)."""
    with tempfile.TemporaryDirectory(prefix="mvreg-interrupts-") as folder:
        child, start = started(words, Path(folder)), time.perf_counter()
        child.communicate(timeout=LIMIT)
        return time.perf_counter() - start


def interrupt(words: tuple[str, ...], delay: float, twice: bool) -> tuple[str, str]:
    """What a process ends with that is interrupted after `delay` seconds, and what it says."""
    with tempfile.TemporaryDirectory(prefix="mvreg-interrupts-") as folder:
        child = started(words, Path(folder))
        time.sleep(delay)
        over = is_over(child)
        for _ in range(1 + twice):
            if child.poll() is None:
                os.killpg(child.pid, signal.SIGINT)
                time.sleep(0.01)
        try:
            _, said = child.communicate(timeout=LIMIT)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            return "hangs", child.communicate()[1]
        return ("was over" if over and child.returncode in (0, 3) else str(child.returncode)), said


def is_over(child: subprocess.Popen[str]) -> bool:
    """Whether a process has decided how it ends: it is gone, or ignores Ctrl-C already (Linux)."""
    try:
        status = Path(f"/proc/{child.pid}/status").read_text()
    except OSError:
        return True
    ignored = next((line for line in status.splitlines() if line.startswith("SigIgn")), "SigIgn: 0")
    return child.poll() is not None or bool(int(ignored.split()[1], 16) >> (signal.SIGINT - 1) & 1)


def main() -> int:
    """Interrupt many processes; 1 if one of them ended otherwise than with 130."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moments", type=int, default=200)
    parser.add_argument("--busy", action="store_true")
    parser.add_argument("--launcher", default="basic", help="of the sweeps: basic or joblib")
    parser.add_argument("--rng", type=int, default=0)
    asked = parser.parse_args()
    burn = [sys.executable, "-c", "while True: pass"]
    others = [subprocess.Popen(burn) for _ in range(os.cpu_count() or 1 if asked.busy else 0)]
    rng, console = np.random.default_rng(asked.rng), Console()
    sweep = (*SWEEP, f"hydra/launcher={asked.launcher}")
    seen: Counter[str] = Counter()
    wrong: list[str] = []
    try:
        lasts = {words: duration(words) for words in (RUN, sweep)}
        for number in track(range(asked.moments), description="moments"):
            words = sweep if number % 4 == 3 else RUN
            delay = float(rng.uniform(0.002, lasts[words]))
            code, said = interrupt(words, delay, twice=number % 5 == 4)
            seen[code] += 1
            if code not in ("130", "was over") or "Traceback" in said:
                wrong.append(f"after {delay:.3f} s of {' '.join(words)}: {code}\n{said}")
    finally:
        for other in others:
            other.kill()
    console.print(f"{asked.moments} moments: {dict(seen)}; {len(wrong)} wrong")
    for one in wrong:
        console.print(one, markup=False)
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
