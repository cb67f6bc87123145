"""Ctrl-C in a process of the command line: it ends with 130, at whatever moment it comes.

The first one interrupts what is under way, so that what was finished is kept; a second one ends the
process at once. When all is done, and only the interpreter is left to end, it changes nothing.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
from contextlib import suppress
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
        signal.signal(signal.SIGINT, first)
        sys.unraisablehook = again
        atexit.register(end)  # what is registered first is called last


def interrupted() -> bool:
    """Whether Ctrl-C has come already, even if somebody made another error of it.

    An interrupt while Open3D is being imported, for one, comes out as an ImportError.
    """
    return signal.getsignal(signal.SIGINT) is leave


def done() -> None:
    """All that is left is to end, which Ctrl-C does not change any more.

    Python gives up its handlers early in its own end: the signal would kill it then, were it not
    ignored.
    """
    if signal.getsignal(signal.SIGINT) is first:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def end() -> None:
    """End an interrupted process, once the libraries have tidied up: joblib ends its workers.

    Not by way of their destructors, which may have a code of their own: Open3D's ends the process
    with 1 if its import was cut short.
    """
    if interrupted():
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):  # nobody reads it any more
                stream.flush()
        os._exit(INTERRUPTED)


def first(number: int, frame: FrameType | None) -> NoReturn:
    """Interrupt what is under way; the next one will not be so polite."""
    signal.signal(signal.SIGINT, leave)
    raise KeyboardInterrupt


def leave(number: int, frame: FrameType | None) -> NoReturn:
    """End the process at once, and the processes that it has started for a sweep."""
    tasks = "/proc/self/task"  # Linux only; and pathlib would take long to import
    for task in os.listdir(tasks) if os.path.isdir(tasks) else ():  # noqa: PTH112, PTH208
        with suppress(OSError), open(f"{tasks}/{task}/children") as children:  # noqa: PTH123
            for child in children.read().split():
                with suppress(ProcessLookupError):
                    os.kill(int(child), signal.SIGTERM)
    os._exit(INTERRUPTED)


def again(ignored: sys.UnraisableHookArgs) -> None:
    """Interrupt once more where Python cannot raise, in a destructor or a callback."""
    if ignored.exc_type is KeyboardInterrupt:
        from threading import Timer  # seldom needed, and Ctrl-C may come while it is imported

        signal.signal(signal.SIGINT, first)
        later = Timer(LATER, os.kill, (os.getpid(), signal.SIGINT))  # not in here, once more
        later.daemon = True
        later.start()
    else:
        sys.__unraisablehook__(ignored)
