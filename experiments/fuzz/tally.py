"""How far a long job of damaged files has come, on disk: what was read, and what came of it."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path

from rich.table import Table

from mvreg.report.run_folder import write_text


@dataclass
class Tally:
    """What has been read.

    Parameters
    ----------
    file : Path
        Where it is kept.
    next : dict of str to int
        The first seed that was not yet read, by the name of the good file.
    counts : dict of str to dict
        How many files came to what, by name.
    wrong : list of [str, int, str]
        Name, seed, and what is wrong.
    seconds : float
        Spent so far.
    """

    file: Path
    next: dict[str, int] = field(default_factory=dict)
    counts: dict[str, dict[str, int]] = field(default_factory=dict)
    wrong: list[tuple[str, int, str]] = field(default_factory=list)
    seconds: float = 0.0

    @classmethod
    def of(cls, file: Path) -> Tally:
        """What a file has kept; nothing where there is none."""
        if not file.exists():
            return cls(file)
        kept = json.loads(file.read_text())
        kept["wrong"] = [(name, seed, what) for name, seed, what in kept["wrong"]]
        return cls(file, **kept)

    @property
    def files(self) -> int:
        """How many have been read."""
        return sum(sum(counts.values()) for counts in self.counts.values())

    def add(self, name: str, seed: int, found: str, fine: Iterable[str]) -> None:
        """Take notice of a file."""
        counts = self.counts.setdefault(name, {})
        kind = found if found in fine else "wrong"
        counts[kind] = counts.get(kind, 0) + 1
        if kind == "wrong":
            self.wrong.append((name, seed, found))
        self.next[name] = seed + 1

    def save(self) -> None:
        """Keep it; whoever reads the file meanwhile finds the old one or the new one."""
        kept = asdict(self)
        del kept["file"]
        self.file.parent.mkdir(parents=True, exist_ok=True)
        write_text(self.file, json.dumps(kept))

    def table(self, kinds: Iterable[str]) -> Table:
        """A row for each format, by the ending of its files."""
        columns = (*kinds, "wrong")
        shown = Table("format", "files", *columns)
        by_format: dict[str, Counter[str]] = {}
        for name, counts in sorted(self.counts.items()):
            by_format.setdefault(name.rpartition(".")[2], Counter()).update(counts)
        by_format["all"] = sum(by_format.values(), Counter())
        for suffix, found in by_format.items():
            cells = [found.total(), *(found[kind] for kind in columns)]
            shown.add_row(suffix, *(f"{count:,}" for count in cells))
        return shown
