"""The file that a benchmark keeps: every single run, with the code and machine that it is of."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from mvreg.report import provenance
from mvreg.report.run_folder import write_text

REPOSITORY = Path(__file__).resolve().parents[2]
#: Of the code that is measured, and of what measures it.
SOURCES = (".py", ".so", ".pyd", ".yaml", ".toml")
MEASURING = ("child.py", "column.py", "free.py", "relief.py")
SCHEMA = 1
#: What a run that took longer than it may is told with; it is not run again.
TOO_LONG = "longer than"


@dataclass(frozen=True)
class Context:
    """What measurements must share to be compared: the code, the machine, the versions."""

    code: str
    commit: str
    machine: Mapping[str, Any]
    versions: Mapping[str, str]


@dataclass(frozen=True)
class Record:
    """One measurement.

    `part`, `row`, `group`, `size` and `key` are those of its case. `answer` is what the process
    measured inside itself, None where there is none; `error` then says why. `wall` is the time of
    the whole process (s), `others` how many cores were busy with something else meanwhile.
    """

    part: str
    row: str
    group: str
    size: int
    key: str
    number: int
    answer: Mapping[str, Any] | None
    error: str | None
    wall: float | None
    others: float | None
    finished: str
    context: Context
    spec: Mapping[str, Any] = field(default_factory=dict)

    @property
    def too_long(self) -> bool:
        """Whether it was ended, or not begun, for the time that it takes; `wall` is the limit."""
        return self.error is not None and self.error.startswith(TOO_LONG)

    def value(self, name: str) -> float | None:
        """A number of the answer."""
        found = (self.answer or {}).get(name)
        return None if found is None else float(found)


def context(repository: Path = REPOSITORY) -> Context:
    """Of what would be measured now."""
    commit = provenance.commit() or "not known"
    return Context(digest(repository), commit, provenance.machine(), provenance.versions())


def digest(repository: Path) -> str:
    """A name for the code as it is now, committed or not; tests and documents do not count."""
    found = hashlib.sha256()
    files = [repository / "experiments/bench" / name for name in MEASURING]
    for part in provenance.CODE:
        place = repository / part
        files += [place] if place.is_file() else sorted(place.rglob("*"))
    for file in files:
        inside = file.relative_to(repository).parts
        if file.suffix in SOURCES and file.is_file() and not {"tests", "build"} & set(inside):
            found.update("/".join(inside).encode() + b"\0" + file.read_bytes() + b"\0")
    return found.hexdigest()[:12]


def load(file: Path) -> list[Record]:
    """What a file holds, in the order in which it was measured; nothing where there is no file.

    Raises
    ------
    ValueError
        If it is no such file.
    """
    if not file.is_file():
        return []
    kept = json.loads(file.read_text("utf-8"))
    if not isinstance(kept, dict) or kept.get("schema") != SCHEMA:
        raise ValueError(f"{file}: expected a benchmark's file with schema {SCHEMA}")
    contexts = [Context(**each) for each in kept["contexts"]]
    return [Record(**{**each, "context": contexts[each["context"]]}) for each in kept["records"]]


def save(file: Path, records: Sequence[Record]) -> None:
    """Write all records; whoever reads the file meanwhile finds the old ones or the new ones."""
    contexts: list[dict[str, Any]] = []
    rows = []
    for record in records:
        row = asdict(record)
        if row["context"] not in contexts:
            contexts.append(row["context"])
        rows.append({**row, "context": contexts.index(row["context"])})
    file.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"schema": SCHEMA, "contexts": contexts, "records": rows}, indent=1)
    write_text(file, text + "\n")


def same(one: Context, other: Context) -> bool:
    """Whether measurements of two contexts compare; a commit may add documents only."""
    return (one.code, one.machine, one.versions) == (other.code, other.machine, other.versions)


def done(records: Sequence[Record], now: Context, limit: float) -> set[tuple[str, int]]:
    """Keys and rounds that need not be run again, when a process may take `limit` seconds."""
    return {
        (r.key, r.number)
        for r in records
        if same(r.context, now) and (r.error is None or (r.too_long and (r.wall or 0) >= limit))
    }


def latest(records: Sequence[Record], part: str) -> list[Record]:
    """The records of a part that compare with the last one of it; of each run the last."""
    own = [record for record in records if record.part == part]
    if not own:
        return []
    found = {(r.key, r.number): r for r in own if same(r.context, own[-1].context)}
    return list(found.values())
