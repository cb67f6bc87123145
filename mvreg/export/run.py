"""Export a run: from its report, and where points are wanted from its scans."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mvreg.errors import InputError, PluginError, few
from mvreg.export.formats import Format, PointFormat
from mvreg.export.model import Model
from mvreg.export.placements import Component, Placements, placements
from mvreg.export.targets import Targets
from mvreg.types import ScanSet, View


def export(
    report: Mapping[str, Any],
    formats: Iterable[Format],
    folder: Path,
    scans: Callable[[], ScanSet],
    views: Callable[[ScanSet], Sequence[View]],
    targets: Targets | None = None,
) -> list[str]:
    """Write a run in some formats.

    Parameters
    ----------
    report : mapping
        Of the run, as `mvreg.report.json_file.load_report` reads it.
    formats : iterable of Format
        See `mvreg.export.table.formats_of`.
    folder : Path
        Made if it is missing. The reference's model is here, others in ``component_2``, and so on.
    scans : callable
        Loads the scans; called only if points are wanted.
    views : callable
        The scans as they were registered, for the residuals of models; called only if a format
        has these. None may be returned: then points have no residuals.
    targets : Targets, optional
        Known in the frame of a map, into which all goes.

    Returns
    -------
    list of str
        What is to be said: scans without a pose, what a format could not keep.

    Raises
    ------
    InputError
        If the scans are not those of the run, or a file cannot be written.
    PluginError
        If a plugin's format fails; the other formats are written.
    """
    found, told = placements(report), list[str]()
    if targets is not None:
        found, told = targets.in_map(found)
    formats = list(formats)
    scanset: ScanSet | None = None
    registered: Sequence[View] = ()
    if any(isinstance(each, PointFormat) for each in formats):
        scanset = scans()
        _check(scanset, found)
        if any(isinstance(each, PointFormat) and each.residuals for each in formats):
            registered = views(scanset)
    remarks = [*told, *_missing(found)]
    failed: dict[str, PluginError] = {}
    for component in found.components:
        below = folder / f"component_{component.number}" if component.number > 1 else folder
        try:
            below.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{below}: cannot be made: {error.strerror or error}") from error
        for each in formats:
            try:
                said = _write(each, below, component, found, scanset, registered)
            except PluginError as error:  # the other formats are not at fault
                failed.setdefault(each.name, error)
                continue
            remarks += [f"{each.name}: {remark}" for remark in said]
    if failed:
        first = next(iter(failed.values()))
        others = [each.name for each in formats if each.name not in failed]
        raise PluginError(f"{first}; written: {few(others) if others else 'nothing'}") from first
    return list(dict.fromkeys(remarks))


def _write(
    each: Format,
    folder: Path,
    component: Component,
    found: Placements,
    scanset: ScanSet | None,
    views: Sequence[View],
) -> list[str]:
    try:
        if isinstance(each, PointFormat):
            assert scanset is not None
            return each.write(folder, Model(scanset, component, found, views))
        return each.write(folder, component, found)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror or error}") from error


def _missing(found: Placements) -> list[str]:
    """What is said of scans that are not in the reference's model."""
    said = []
    if found.unplaced:
        names = list(found.unplaced)
        said.append(f"{len(names)} scan(s) without a pose are left out: {few(names)}")
    for c in found.components:
        if c.number > 1:
            own = f"a frame of its own, that of {c.reference}"
            frame = own if c.reference else "the frame of the map"
            said.append(f"component_{c.number} is in {frame}: {few(list(c.poses))}")
    return said


def _check(scanset: ScanSet, found: Placements) -> None:
    """Refuse scans of other names than the run's."""
    have = {scan.name for scan in scanset.scans}
    lacking = [name for c in found.components for name in c.poses if name not in have]
    if lacking:
        raise InputError(
            f"the run placed scans that data set {scanset.name!r} does not have any more: "
            f"{few(lacking)}; put the files back, or say where they are with --scans DIR"
        )
