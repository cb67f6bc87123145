"""Performance targets on two otherwise idle cores, and whether they are met."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from experiments.bench.free import FREE, JOINT
from experiments.bench.numbers import ratio
from experiments.bench.plan import COMMANDS
from experiments.bench.records import Record, latest
from experiments.bench.tables import Groups, Table, fitted, grouped, of

#: Seconds that FCPMA and the default method may take.
SECONDS: Mapping[str, tuple[float, float]] = {
    "bunny": (1.0, 2.0), "dragon": (2.0, 3.0), "buddha": (4.0, 6.0),
}  # fmt: skip
#: Seconds to read the files.
LOADING = {"bunny": 0.5, "buddha": 1.0}
#: How many times as long the peers are to take on the Bunny as FCPMA, the fastest variant of each.
TIMES = {"open3d_multiway": 20.0, "kiss_gicp": 5.0}
#: Seconds from the start to the prompt.
WHOLE = {"run": 4.0, "help": 1.0}
#: Exponents of the default method's time, in the number of scans and in the points of each.
EXPONENTS = {"scans": 1.15, "points": 1.1}
#: Pairs attempted for each scan, however many there are, and MB on the largest real set.
PAIRS, MEMORY = 1.5, 1000.0
LARGEST = "buddha"


@dataclass(frozen=True)
class Bar:
    """Something to be reached: `value` is ours, None where it was not measured."""

    name: str
    value: float | None
    bar: float
    at_least: bool = False

    @property
    def reached(self) -> str:
        """Whether it is."""
        if self.value is None:
            return "not measured"
        good = self.value >= self.bar if self.at_least else self.value <= self.bar
        return "yes" if good else "**no**"


def bars(records: Sequence[Record]) -> Table:
    """All of them."""
    real = grouped(latest(records, "methods"))
    found = [*times(real), *beside(real), *whole(grouped(latest(records, "start")))]
    for part, most in EXPONENTS.items():
        grown = fitted(latest(records, part), "auto", "seconds")
        found.append(Bar(f"exponent of the time in the {WORDS[part]}, auto",
                         None if grown is None else grown.exponent, most))  # fmt: skip
    found.append(Bar("most pairs / N, auto", most_pairs(latest(records, "scans")), PAIRS))
    rows = [
        [bar.name, "" if bar.value is None else f"{bar.value:.4g}",
         f"at {'least' if bar.at_least else 'most'} {bar.bar:.4g}", bar.reached]
        for bar in found
    ]  # fmt: skip
    return Table("Bars", ["what", "ours", "bar", "reached"], rows)


WORDS = {"scans": "number of scans", "points": "points per scan"}


def times(real: Groups) -> list[Bar]:
    """Seconds and memory on real scans."""
    found = []
    for name, limits in SECONDS.items():
        for method, most in zip(("fcpma", "auto"), limits, strict=True):
            found.append(Bar(f"time on {name}, {method} (s)",
                             median(real, name, method, "seconds"), most))  # fmt: skip
    for name, most in LOADING.items():
        found.append(Bar(f"loading {name} (s)", median(real, name, "fcpma", "load"), most))
    memory = [median(real, LARGEST, method, "peak_mb") for method in ("fcpma", "auto")]
    known = [each for each in memory if each is not None]
    return [*found, Bar(f"peak memory on {LARGEST} (MB)", max(known, default=None), MEMORY)]


def beside(real: Groups) -> list[Bar]:
    """FCPMA on the Bunny beside the peers: how much faster, and with what errors.

    Once as it is, and once with all poses refined jointly.
    """
    found = []
    for method in ("fcpma", "fcpma" + JOINT):
        ours = real.get(("bunny", method))
        if method.endswith(JOINT) and ours is None:
            continue
        for peer, least in TIMES.items():
            both = [of(real.get(("bunny", name)), "seconds") for name in (peer, peer + FREE)]
            ratios = [ratio(each, of(ours, "seconds")) for each in both]
            fastest = min((each for each in ratios if each is not None), default=None)
            found.append(
                Bar(f"{peer} takes times as long as {method} on bunny", fastest, least, True)
            )
        for name, words in (("rotation", "e_R"), ("translation", "e_t (mm)")):
            theirs = median(real, "bunny", "open3d_multiway", name)
            if theirs is not None:
                own = median(real, "bunny", method, name)
                found.append(
                    Bar(f"{words} of {method} on bunny, beside open3d_multiway's", own, theirs)
                )
    return found


def whole(commands: Groups) -> list[Bar]:
    """Whole commands."""
    return [
        Bar(f"`{COMMANDS[name][0]}`, start to prompt (s)",
            median(commands, name, COMMANDS[name][0], "wall"), most)
        for name, most in WHOLE.items()
    ]  # fmt: skip


def median(groups: Groups, group: str, row: str, name: str) -> float | None:
    """The median of a number of one case."""
    found = of(groups.get((group, row)), name)
    return None if found is None else found.median


def most_pairs(records: Sequence[Record]) -> float | None:
    """The most pairs that the default method attempted for each scan, of all sizes."""
    wanted: Callable[[str], bool] = "auto".__eq__
    found = [of(runs, "pairs_per_scan") for (_, row), runs in grouped(records).items()
             if wanted(row)]  # fmt: skip
    return max((each.median for each in found if each is not None), default=None)
