"""A batch service: folders of scans come into an inbox, results go to an outbox, as JSON.

    inbox/chair/*.ply       a job; ready once there is a file inbox/chair/ready
    inbox/chair/cancel      calls it off, waiting or under way
    outbox/chair.json       what came of it: poses, how sure, or why not

Each job has a time limit. Ctrl-C or SIGTERM end the service; a job that was under way is done again
when it is started the next time, from where it was: finished work is kept in outbox/store.

    python examples/batch_service.py inbox outbox --seconds 600
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import mvreg

#: What came of a job: all placed, some, none in time, called off, or wrong input.
PLACED, PARTLY, LATE, CANCELLED, REFUSED = "placed", "partly", "late", "cancelled", "refused"


class ServiceStoppedError(Exception):
    """The service is to end, and the job that is under way with it."""


@dataclass
class Service:
    """Works off jobs, one after the other.

    Parameters
    ----------
    inbox, outbox : Path
    seconds : float
        Limit for a job.
    method : str
        As in ``+method=NAME``.
    """

    inbox: Path
    outbox: Path
    seconds: float = 600.0
    method: str = "auto"
    stopped: bool = field(default=False, init=False)

    def stop(self, number: int, frame: FrameType | None) -> None:
        """End at the next event of the registration: what a signal calls."""
        self.stopped = True

    def waiting(self) -> list[Path]:
        """Folders that are ready and have no result, the oldest first."""
        ready = [file for file in self.inbox.glob("*/ready") if not self.answer(file).exists()]
        return [file.parent for file in sorted(ready, key=lambda file: file.stat().st_mtime)]

    def answer(self, ready: Path) -> Path:
        """Where the result of a job goes."""
        return self.outbox / f"{ready.parent.name}.json"

    def run(self, once: bool, pause: float = 1.0) -> None:
        """Work until stopped, or until nothing is left."""
        self.outbox.mkdir(parents=True, exist_ok=True)
        while not self.stopped:
            jobs = self.waiting()
            if jobs:
                self.work(jobs[0])
            elif once:
                return
            else:
                time.sleep(pause)

    def work(self, job: Path) -> None:
        """Do one job, and leave its result; none if the service is stopped meanwhile."""
        started = time.monotonic()
        try:
            found = self.registered(job, started + self.seconds)
        except ServiceStoppedError:
            print(f"{job.name}: left for the next time", flush=True)
            return
        except mvreg.MvregError as error:  # its text is for people
            found = {"status": REFUSED, "message": str(error)}
        found["seconds"] = round(time.monotonic() - started, 3)
        write(self.answer(job / "ready"), found)
        print(f"{job.name}: {found['status']}", flush=True)

    def registered(self, job: Path, deadline: float) -> dict[str, object]:
        """Register the scans of a job before a moment of `time.monotonic`."""

        def go_on(now: mvreg.Progress) -> bool:
            if self.stopped:
                raise ServiceStoppedError
            return time.monotonic() < deadline and not (job / "cancel").exists()

        # The service's own files beside the scans are not for the reader of folders.
        scans = mvreg.dataset("folder", path=str(job), pattern="*.*")
        try:
            result = mvreg.register(scans, self.method, progress=go_on, store=self.outbox / "store")
        except mvreg.CancelledError as error:
            status = CANCELLED if (job / "cancel").exists() else LATE
            return {"status": status, "message": str(error), **told(error.result)}
        everything = not (result.unregistered or result.components)
        grades = {
            name: {"grade": about.grade and about.grade.value, "confidence": about.confidence}
            for name, about in mvreg.assess(result).scans.items()
        }
        return {"status": PLACED if everything else PARTLY, **told(result), "grades": grades}


def told(result: mvreg.Result | None) -> dict[str, object]:
    """A result as JSON has it; poses ``T_model_scan`` as 4 rows of 4 numbers."""
    if result is None:
        return {"poses": {}, "components": [], "unregistered": []}
    models = [
        {name: pose.tolist() for name, pose in poses.items()}
        for poses in (result.poses, *result.components)
    ]
    return {
        "reference": result.reference,
        "poses": models[0],
        "components": models[1:],
        "unregistered": list(result.unregistered),
    }


def write(file: Path, content: dict[str, object]) -> None:
    """Write JSON, all of it or nothing: whoever waits for the file may read it at once."""
    part = file.with_suffix(".part")
    part.write_text(json.dumps(content, indent=1), encoding="utf-8")
    part.replace(file)


def main(words: list[str] | None = None) -> int:
    """Watch a folder of jobs."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("inbox", type=Path)
    parser.add_argument("outbox", type=Path)
    parser.add_argument("--seconds", type=float, default=600.0, help="limit for a job")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--once", action="store_true", help="end when nothing is left to do")
    asked = parser.parse_args(words)
    service = Service(asked.inbox, asked.outbox, asked.seconds, asked.method)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, service.stop)
    service.run(asked.once)
    return 0


if __name__ == "__main__":
    sys.exit(main())
