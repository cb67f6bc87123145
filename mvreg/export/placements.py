"""What a report says of the poses: all that an export of poses needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.types import Array


@dataclass(frozen=True)
class Link:
    """Two placed scans in contact, and the probability that their relative pose is right."""

    source: str
    target: str
    confidence: float


@dataclass(frozen=True, eq=False)
class Component:
    """One partial model.

    Parameters
    ----------
    number : int
        1 is the reference's.
    reference : str
        The scan whose frame is the component's; empty where that is the frame of a map.
    poses : mapping of str to (4, 4) array
        ``T_model_scan`` by scan, in the order of the data set, from the frame that the scan has in
        its file: what ``dataset.scramble`` did is undone.
    links : tuple of Link
        Between its scans.
    """

    number: int
    reference: str
    poses: Mapping[str, Array]
    links: tuple[Link, ...] = ()


@dataclass(frozen=True, eq=False)
class Placements:
    """The poses of a run.

    Parameters
    ----------
    names : tuple of str
        Of all scans, in the order of the data set.
    components : tuple of Component
        The reference's first; only those with a pose.
    unplaced : tuple of str
        Scans without a pose.
    resolution : float or None
        Median spacing of the scans (length).
    """

    names: tuple[str, ...]
    components: tuple[Component, ...]
    unplaced: tuple[str, ...]
    resolution: float | None = None

    def number(self, name: str) -> int:
        """The number of a scan, from 0, in the order of the data set."""
        return self.names.index(name)


def placements(report: Mapping[str, Any]) -> Placements:
    """The poses that a report has.

    Parameters
    ----------
    report : mapping
        Of the present schema, as `mvreg.report.json_file.load_report` reads it.

    Raises
    ------
    InputError
        If a pose is no rigid motion: the report was changed by hand.
    """
    names = tuple(str(scan["name"]) for scan in report.get("scans") or ())
    motions = report.get("motions") or {}
    links = [
        Link(link["source"], link["target"], float(link["confidence"] or 0))
        for link in report.get("links") or ()
    ]
    models = [(1, report["reference"], report["poses"])]
    models += [(each["number"], each["reference"], each["poses"])
               for each in report.get("components") or ()]  # fmt: skip
    names = names or tuple(name for _, _, poses in models for name in poses)
    components = []
    for number, reference, poses in models:
        own = {name: _pose(name, poses[name], motions.get(name)) for name in names if name in poses}
        between = tuple(link for link in links if link.source in own and link.target in own)
        if own:
            components.append(Component(number, reference, own, between))
    unplaced = tuple(name for name in names if not any(name in c.poses for c in components))
    return Placements(names, tuple(components), unplaced, report.get("resolution"))


def _pose(name: str, rows: Sequence[Sequence[float]], motion: object) -> Array:
    pose = _rigid(rows, f"result.json, pose of {name!r}")
    return pose if motion is None else pose @ _rigid(motion, f"result.json, motion of {name!r}")


def _rigid(rows: object, where: str) -> Array:
    try:
        pose = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        pose = np.empty(0)
    good = pose.shape == (4, 4) and bool(np.isfinite(pose).all())
    if not good or np.abs(pose - se3.project(pose)).max() > 1e-6 * max(1, np.abs(pose).max()):
        raise InputError(f"{where}: expected a rigid motion as 4 rows of 4 numbers, got {rows}")
    return pose
