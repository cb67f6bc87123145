"""Poses known before registration: to be tried, or to be kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mvreg.errors import InputError, few
from mvreg.io.poses import read_poses_and_remarks
from mvreg.io.scan_names import matched, unused
from mvreg.types import Array, Scan, ScanSet

#: Take the poses that the files of the scans have.
FILE = "file"


def tell_initial(scans: ScanSet, initial: str, fixed: Sequence[str]) -> ScanSet:
    """The same scans with the poses known beforehand.

    Parameters
    ----------
    scans : ScanSet
    initial : str
        A file of poses ``T_world_scan``; ``file`` for those in the scans' own files; empty for
        none, but that a fixed scan has the pose of its own file.
    fixed : sequence of str
        Names of scans that keep theirs.

    Raises
    ------
    InputError
        If there is no such scan, or the poses are of none of the scans.
    """
    names = [scan.name for scan in scans.scans]
    unknown = [name for name in fixed if name not in names]
    if unknown:
        raise InputError(
            f"dataset.fixed={list(fixed)}: expected names of scans, {few(names)}; "
            f"got {', '.join(unknown)}"
        )
    known, remarks = _known(scans, initial, names)
    return replace(
        scans,
        scans=tuple(_told(scan, known, fixed) for scan in scans.scans),
        remarks=(*scans.remarks, *remarks),
    )


def _known(
    scans: ScanSet, initial: str, names: list[str]
) -> tuple[Mapping[str, Array], tuple[str, ...]]:
    """Poses by the scans' names, and what is to be said of them."""
    if initial in ("", FILE):
        if initial and not scans.initial:
            raise InputError(
                "dataset.initial=file: expected scans with poses in their files, found none; of "
                "the formats E57 and PTX have them"
            )
        return scans.initial, ()
    found, remarks = read_poses_and_remarks(initial)
    pairs = matched(found, names, f"dataset.initial={initial}")
    if not pairs:
        raise InputError(
            f"dataset.initial={initial}: expected poses of the scans {few(names)}; got poses of "
            f"{few(list(found))}"
        )
    known = {scan: found[name] for name, scan in pairs.items()}
    return known, (*remarks, *unused(found, pairs, Path(initial)))


def _told(scan: Scan, known: Mapping[str, Array], fixed: Sequence[str]) -> Scan:
    if scan.name in fixed:
        return replace(scan, initial=known.get(scan.name, np.eye(4)), fixed=True)
    return replace(scan, initial=known.get(scan.name))
