"""What was read for a run, what was not, and what looks wrong with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Finding:
    """Something that looks wrong with scans.

    Parameters
    ----------
    kind : str
        A word: ``unit``, ``copy``, ``steps``, ``stray``; after registration, ``mirrored``
        and ``scale``.
    scans : tuple of str
        The names of the scans that it is about.
    text : str
        What was found, in words.
    advice : str
        What to do about it.
    """

    kind: str
    scans: tuple[str, ...]
    text: str
    advice: str


@dataclass(frozen=True)
class Input:
    """What a folder of files held.

    Parameters
    ----------
    files : int
        How many were read as scans.
    left_out : mapping of str to str
        The reason by the name of each file that was not, and of each folder.
    findings : tuple of Finding
        What looks wrong.
    """

    files: int
    left_out: Mapping[str, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
