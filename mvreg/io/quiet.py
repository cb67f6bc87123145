"""Open3D without its warnings, from any thread."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from types import ModuleType

from mvreg._open3d import load_open3d

_ONE = Lock()


@contextmanager
def quiet_open3d() -> Iterator[ModuleType]:
    """Open3D with its warnings off, for one thread at a time: how loud it is, is the process's.

    Raises
    ------
    MvregError
        If Open3D cannot be loaded.
    """
    with _ONE:
        open3d = load_open3d()
        with open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
            yield open3d
