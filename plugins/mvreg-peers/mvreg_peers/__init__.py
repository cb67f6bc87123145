"""What one would use instead of mvreg, as a plugin of it: `open3d_multiway` and `kiss_gicp`."""

from __future__ import annotations

import mvreg


@mvreg.hookimpl
def mvreg_stages() -> dict[str, type]:
    """Return the strategies; what they need beyond mvreg is imported when they run."""
    from mvreg_peers.kiss_gicp import KissGicpStrategy
    from mvreg_peers.open3d_multiway import Open3dMultiwayStrategy

    return {
        "strategy/open3d_multiway": Open3dMultiwayStrategy,
        "strategy/kiss_gicp": KissGicpStrategy,
    }


@mvreg.hookimpl
def mvreg_config_path() -> str:
    """Return where ``+method=open3d_multiway`` and ``+method=kiss_gicp`` are."""
    return "pkg://mvreg_peers.conf"


@mvreg.hookimpl
def mvreg_suites() -> dict[str, type]:
    """Return the suites for strategies that work on raw scans."""
    from mvreg_peers.suites import KissGicpSuite, Open3dMultiwaySuite

    return {"strategy/open3d_multiway": Open3dMultiwaySuite, "strategy/kiss_gicp": KissGicpSuite}
