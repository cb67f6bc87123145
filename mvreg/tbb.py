"""Threads of libraries that are built on oneTBB, such as Open3D and KISS-Matcher.

They take every core, whatever OMP_NUM_THREADS says (Open3D 0.20): neither has a setting for it, but
oneTBB has, ``tbb::global_control`` of its C++ interface. And they sum in parallel in an order that
changes from call to call: Open3D's ICP then differs in the last bits, KISS-Matcher in its inliers.
With one thread the answers are repeatable.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import ModuleType

__all__ = ["copies_of_tbb", "limit", "one_thread", "threads_allowed"]

#: ``tbb::global_control::max_allowed_parallelism``.
PARALLELISM = 0
CREATE = "_ZN3tbb6detail2r16createERNS0_2d114global_controlE"
DESTROY = "_ZN3tbb6detail2r17destroyERNS0_2d114global_controlE"
ACTIVE = "_ZN3tbb6detail2r127global_control_active_valueEi"


class GlobalControl(ctypes.Structure):
    """``tbb::global_control``, a part of oneTBB's binary interface."""

    _fields_ = (
        ("value", ctypes.c_size_t),
        ("reserved", ctypes.c_ssize_t),
        ("parameter", ctypes.c_int),
    )


#: The limits set for good: oneTBB keeps pointers to them.
_HELD: list[GlobalControl] = []


def limit(module: ModuleType, count: int) -> None:
    """Let the copies of oneTBB that came with a module use `count` threads at most, for good.

    Of several limits the lowest counts. Where a library is not oneTBB as GCC and Clang build it, as
    on Windows, nothing happens.

    Parameters
    ----------
    module : module
        As imported.
    count : int
        1 or more.
    """
    for path in copies_of_tbb(module):
        library = ctypes.CDLL(str(path))
        if hasattr(library, CREATE):
            control = GlobalControl(count, 0, PARALLELISM)
            getattr(library, CREATE)(ctypes.byref(control))
            _HELD.append(control)


@contextmanager
def one_thread(*libraries: Path) -> Iterator[None]:
    """Inside, these copies of oneTBB start no threads; other threads may still call them.

    Where a library is not oneTBB as GCC and Clang build it, as on Windows, nothing happens, and
    answers are repeatable up to rounding only.
    """
    with ExitStack() as stack:
        for path in libraries:
            stack.enter_context(_limited(ctypes.CDLL(str(path))))
        yield


@contextmanager
def _limited(library: ctypes.CDLL) -> Iterator[None]:
    """Hold one copy of oneTBB at one thread."""
    if not all(hasattr(library, name) for name in (CREATE, DESTROY)):
        yield
        return
    control = GlobalControl(1, 0, PARALLELISM)
    getattr(library, CREATE)(ctypes.byref(control))
    try:
        yield
    finally:
        getattr(library, DESTROY)(ctypes.byref(control))


def threads_allowed(library: Path) -> int:
    """How many threads this copy of oneTBB may use now."""
    found = getattr(ctypes.CDLL(str(library)), ACTIVE)
    found.restype = ctypes.c_size_t
    return int(found(PARALLELISM))


def copies_of_tbb(module: ModuleType) -> list[Path]:
    """The copies of oneTBB that came with an installed module.

    Wheels keep libraries beside the module, in ``NAME.libs`` (Linux) or ``.dylibs`` (macOS).
    """
    package = Path(str(module.__file__)).parent
    folders = (package, package.with_name(f"{package.name}.libs"), package / ".dylibs")
    return sorted(file for folder in folders for file in folder.glob("libtbb[-.]*"))
