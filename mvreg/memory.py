"""Memory that is no longer needed goes back to the system, on Linux with glibc."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable

#: Parameters of glibc's ``mallopt``.
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3
#: Arrays from so many bytes on have pages of their own. glibc begins so, with an eighth of a
#: megabyte, but puts larger and larger ones into its heaps as such are freed, of which it then
#: returns only the ends.
LARGE = 4 << 20


def give_back_arrays() -> None:
    """Let large arrays go back to the system as soon as nobody holds them.

    For a process of one's own, such as that of the command line: it holds for all that it does. Of
    ten scans of which half a million points are held the peak is a sixth lower.
    """
    mallopt = _function("mallopt")
    if mallopt is not None:
        mallopt(MMAP_THRESHOLD, LARGE)
        mallopt(TRIM_THRESHOLD, LARGE)


def give_back_holes() -> None:
    """Give back what lies free between small things, once a stage is over that made many."""
    trim = _function("malloc_trim")
    if trim is not None:
        trim(0)


def _function(name: str) -> Callable[..., int] | None:
    """A function of the C library; None where it is another."""
    if sys.platform != "linux":
        return None
    try:
        found: Callable[..., int] = getattr(ctypes.CDLL(None), name)
    except (AttributeError, OSError):
        return None
    return found
