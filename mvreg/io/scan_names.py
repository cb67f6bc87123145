"""Which scans a file means that gives their names: with an ending, another one, or none."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path, PurePath

from mvreg.errors import InputError, few


def matched(given: Iterable[str], names: Sequence[str], file: str) -> dict[str, str]:
    """The scans that go by the names in a file, each by one of them, see `meant`.

    Parameters
    ----------
    given : iterable of str
        As the file calls them.
    names : sequence of str
        Of the scans.
    file : str
        For messages.

    Returns
    -------
    dict of str to str
        The scan's name by the given one; those that no scan goes by are left out.

    Raises
    ------
    InputError
        Where a name may mean two scans, or two names the same one.
    """
    given = list(dict.fromkeys(given))
    found = {name: name for name in given if name in names}
    rest = [name for name in names if name not in found]
    others: dict[str, str] = {}
    for one in given:
        scan = None if one in found else meant(one, rest, file)
        if scan is None:
            continue
        if scan in others:
            raise InputError(
                f"{file}: expected one name for the scan {scan}, got {others[scan]} and {one}; "
                "write it in full"
            )
        others[scan] = one
    return found | {one: scan for scan, one in others.items()}


def unused(given: Iterable[str], taken: Collection[str], file: Path) -> tuple[str, ...]:
    """What is said of poses of other scans: one sentence, or nothing."""
    rest = [name for name in given if name not in taken]
    if not rest:
        return ()
    count = "1 pose is" if len(rest) == 1 else f"{len(rest)} poses are"
    return (f"{file.name}: {count} of no scan that is here: {few(rest)}",)


def meant(given: str, names: Sequence[str], file: str) -> str | None:
    """The scan that a file calls so; None where there is none.

    It is the one of this name, else one whose name is this one with or without an ending, else one
    with another ending.

    Raises
    ------
    InputError
        Where it may be any of several.
    """
    for alike in (str.__eq__, _with_an_ending, _with_another):
        scans = [name for name in names if alike(given, name)]
        if len(scans) > 1:
            raise InputError(
                f"{file}: {given} may be any of the scans {few(scans)}; write its name in full"
            )
        if scans:
            return scans[0]
    return None


def _with_an_ending(one: str, other: str) -> bool:
    return PurePath(one).stem == other or one == PurePath(other).stem


def _with_another(one: str, other: str) -> bool:
    """Whether names differ in their endings alone; a number is none: ``scan.1``, ``scan.2``."""
    numbered = any(PurePath(name).suffix[1:].isdigit() for name in (one, other))
    return not numbered and PurePath(one).stem == PurePath(other).stem
