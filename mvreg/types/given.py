"""Scans as a caller gives them: a set, a sequence, a mapping of names.

Public as part of `mvreg.types`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from mvreg.errors import InputError
from mvreg.types.pointlike import PointLike
from mvreg.types.scan import Scan, ScanSet

#: What `mvreg.register` takes for scans.
Scans = ScanSet | Mapping[str, Scan | PointLike] | Iterable[Scan | PointLike]


def as_scans(scans: Scans) -> tuple[Scan, ...]:
    """Scans from whatever a caller has; those without a name are named by their position.

    Raises
    ------
    InputError
        For a path, for one scan instead of several, and for what no `Scan` can be made of.
    """
    if isinstance(scans, ScanSet):
        return scans.scans
    if isinstance(scans, str | Path):
        raise InputError(
            f"expected scans, got {str(scans)!r}; for files use "
            "mvreg.dataset('folder', path=...) and register what it returns"
        )
    if isinstance(scans, Mapping):
        return tuple(_named(name, scan) for name, scan in scans.items())
    single = getattr(scans, "ndim", 0) == 2 or not isinstance(scans, Iterable)
    if single or hasattr(scans, "columns") or hasattr(scans, "vertices"):
        raise InputError(
            f"expected several scans, got one {type(scans).__name__}; pass a list of them, or a "
            "mapping of names to them"
        )
    return tuple(
        scan if isinstance(scan, Scan) else Scan(f"scan_{index:03d}", scan)
        for index, scan in enumerate(scans)
    )


def _named(name: object, scan: Scan | PointLike) -> Scan:
    if not isinstance(name, str):
        raise InputError(
            f"expected a mapping of names to scans, got the name {name!r}, a "
            f"{type(name).__name__}; use str()"
        )
    if not isinstance(scan, Scan):
        return Scan(name, scan)
    return scan if scan.name == name else replace(scan, name=name)
