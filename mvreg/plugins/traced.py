"""What code that is not mvreg's has raised, and where."""

from __future__ import annotations

import inspect
import traceback
from typing import Any


def raised(error: Exception, culprit: Any, passed_over: str | None = None) -> str:
    """What something raised, and where: in its own file if the error came through it.

    Parameters
    ----------
    error : Exception
    culprit : type or callable
        What was called.
    passed_over : str, optional
        The file or folder of the code that called it, whose steps are none of its own.
    """
    steps = traceback.extract_tb(error.__traceback__)
    frames = [
        one for one in steps if passed_over is None or not one.filename.startswith(passed_over)
    ]
    try:
        own = inspect.getsourcefile(culprit)
    except TypeError:  # neither a class nor a function
        own = None
    chosen = [frame for frame in frames if frame.filename == own] or frames
    where = f" at {chosen[-1].filename}:{chosen[-1].lineno}" if chosen else f" calling {own}"
    text = " ".join(str(error).split())
    return f"got {type(error).__name__}: {text}{where}"
