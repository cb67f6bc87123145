"""The systems that FCPMA is compared with, as a plugin of mvreg: `surfc` and `spant`."""

from __future__ import annotations

import mvreg


@mvreg.hookimpl
def mvreg_stages() -> dict[str, type]:
    """Return the strategies, and their tests as judges."""
    from mvreg_comparators.dual import DualJudge
    from mvreg_comparators.spant import SpanningTreeStrategy
    from mvreg_comparators.surfc import SurfaceConsistentStrategy
    from mvreg_comparators.visibility import VisibilityJudge

    return {
        "strategy/surfc": SurfaceConsistentStrategy,
        "strategy/spant": SpanningTreeStrategy,
        "judge/visibility": VisibilityJudge,
        "judge/dual": DualJudge,
    }


@mvreg.hookimpl
def mvreg_config_path() -> str:
    """Return where ``+method=surfc`` and ``+method=spant`` are."""
    return "pkg://mvreg_comparators.conf"


@mvreg.hookimpl
def mvreg_suites() -> dict[str, type]:
    """Return the suites of stages that compare two poses of a pair.

    Their scans are coarse, twenty points to the radius: refined poses are off by 2 degrees.
    """
    from mvreg.testing import JudgeContract, StrategyContract
    from mvreg_comparators.dual import DualJudge
    from mvreg_comparators.spant import SpanningTreeStrategy

    class DualSuite(JudgeContract):
        stage = DualJudge(max_rotation=5.0)

    class SpanningTreeSuite(StrategyContract):
        stage = SpanningTreeStrategy(max_rotation=5.0)

    return {"judge/dual": DualSuite, "strategy/spant": SpanningTreeSuite}
