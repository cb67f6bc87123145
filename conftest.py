"""The option --tier, for the tests of mvreg and of its plugins alike."""

from collections import Counter
from pathlib import Path

import pytest

from tests import tiers

ROOT = Path(__file__).parent
LEFT: pytest.StashKey[Counter[str]] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--tier", choices=tiers.TIERS, default="all", help="what to run, see tests/tiers.py"
    )
    parser.addoption(
        "--renew-golden", action="store_true", help="write golden results instead of comparing"
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what a higher tier runs, and count it by folder."""
    asked = config.getoption("--tier")
    kept, left = [], []
    for item in items:
        path = item.path.relative_to(ROOT).as_posix()
        tier = tiers.tier_of(path, item.get_closest_marker("slow") is not None)
        (kept if tiers.runs(tier, asked) else left).append(item)
    items[:] = kept
    config.hook.pytest_deselected(items=left)
    counts = Counter(item.path.relative_to(ROOT).as_posix() for item in left)
    if hasattr(config, "workeroutput"):  # in a worker of xdist: the controller prints
        config.workeroutput["left"] = dict(counts)
    config.stash[LEFT] = counts


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: object, error: object) -> None:
    """Take over what a worker of xdist counted; each of them collects everything."""
    output = getattr(node, "workeroutput", {})
    node.config.stash[LEFT] = Counter(output.get("left", {}))  # type: ignore[attr-defined]


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    left = config.stash.get(LEFT, Counter())
    if not left:
        return
    asked = config.getoption("--tier")
    following = "all" if asked == "test" else "test and all"
    terminalreporter.section(f"left to --tier {following}: {left.total()} tests")
    for path, count in sorted(left.items()):
        terminalreporter.write_line(f"{count:5}  {path}")
