"""What stands behind a method's name in a row: all threads for a peer, a joint adjustment.

As strategies the peers hold oneTBB at one thread, and GICP too, to repeat to the last bit. That
costs them time, which must not count for mvreg.
"""

from __future__ import annotations

from contextlib import nullcontext
from importlib import import_module
from types import ModuleType, SimpleNamespace
from typing import Any

from mvreg.parallel import threads

#: Behind the name of a peer.
FREE = "+threads"
#: Behind the name of a method: all its poses are refined jointly at the end.
JOINT = "+joint"


def plain(method: str) -> str:
    """The method behind a row's name."""
    return method.removesuffix(FREE).removesuffix(JOINT)


def changes(method: str) -> dict[str, object]:
    """What a row's name changes in the method."""
    return {"adjust": "joint"} if method.endswith(JOINT) else {}


def let_loose(method: str) -> None:
    """In this process the peer uses all threads from now on; other methods stay as they are."""
    if not method.endswith(FREE):
        return
    module = import_module(f"mvreg_peers.{plain(method)}")
    setattr(module, "one_thread", lambda *libraries: nullcontext())  # noqa: B010 for mypy
    if hasattr(module, "load"):
        load = module.load

        def loaded() -> tuple[ModuleType, Any]:
            kiss, gicp = load()
            return kiss, with_threads(gicp)

        setattr(module, "load", loaded)  # noqa: B010


def with_threads(gicp: ModuleType) -> SimpleNamespace:
    """small_gicp's functions, on all threads."""

    def preprocess(points: Any, resolution: float) -> Any:
        return gicp.preprocess_points(points, resolution, num_threads=threads())

    def align(*ends: Any, **options: Any) -> Any:
        return gicp.align(*ends, **{**options, "num_threads": threads()})

    return SimpleNamespace(preprocess_points=preprocess, align=align)
