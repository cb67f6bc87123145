"""What is written to standard output and error, by compiled code too."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def captured() -> Iterator[list[str]]:
    """Collect what the process writes to its file descriptors 1 and 2; the list is filled after.

    What Python's own streams hold back is written out first, to where it belongs.
    """
    written: list[str] = []
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    with tempfile.TemporaryFile() as file:
        before = [(number, os.dup(number)) for number in (1, 2)]
        try:
            for number, _ in before:
                os.dup2(file.fileno(), number)
            yield written
        finally:
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
            for number, kept in before:
                os.dup2(kept, number)
                os.close(kept)
            file.seek(0)
            text = file.read().decode(errors="replace")
            written += [text] if text else []
