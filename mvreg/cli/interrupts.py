"""Ctrl-C in a process of the command line: it ends with 130, at whatever moment it comes.

The first one interrupts what is under way, so that what was finished is kept; a second one ends the
process at once. When all is done, and only the interpreter is left to end, it changes nothing.
"""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from threading import Timer
from types import FrameType
from typing import NoReturn

#: Exit code of a process that Ctrl-C has ended, as shells have it.
INTERRUPTED = 130
#: Seconds until an interrupt is tried again that came where nothing can be raised.
LATER = 0.01


def listen() -> None:
    """Take over Ctrl-C, unless it is ignored, as for a process that was started in the background.

    For a process of one's own: nothing is as it was before.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        sys.unraisablehook = again
        signal.signal(signal.SIGINT, first)


def interrupted() -> bool:
    """Whether Ctrl-C has come already, even if somebody made another error of it.

    An interrupt while Open3D is being imported, for one, comes out as an ImportError.
    """
    return signal.getsignal(signal.SIGINT) is leave


def done() -> None:
    """All that is left is to end, which Ctrl-C does not change any more.

    Python gives up its handlers early in its own end: the signal would kill it then, were it not
    ignored. A process that was interrupted ends here and now: libraries whose import was cut short
    may end it with a code of their own.
    """
    if interrupted():
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):  # nobody reads it any more
                stream.flush()
        os._exit(INTERRUPTED)
    if signal.getsignal(signal.SIGINT) is first:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def first(number: int, frame: FrameType | None) -> NoReturn:
    """Interrupt what is under way; the next one will not be so polite."""
    signal.signal(signal.SIGINT, leave)
    raise KeyboardInterrupt


def leave(number: int, frame: FrameType | None) -> NoReturn:
    """End the process at once, and the processes that it has started for a sweep."""
    for file in Path("/proc/self/task").glob("*/children"):  # Linux only
        with suppress(OSError, ValueError):
            for child in file.read_text().split():
                os.kill(int(child), signal.SIGTERM)
    os._exit(INTERRUPTED)


def again(ignored: sys.UnraisableHookArgs) -> None:
    """Interrupt once more where Python cannot raise, in a destructor or a callback."""
    if ignored.exc_type is KeyboardInterrupt:
        signal.signal(signal.SIGINT, first)
        later = Timer(LATER, os.kill, (os.getpid(), signal.SIGINT))  # not in here, once more
        later.daemon = True
        later.start()
    else:
        sys.__unraisablehook__(ignored)
