"""The poses of a run in the frame of a map, by targets whose coordinates there are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mvreg.errors import InputError, few
from mvreg.export.placements import Component, Placements
from mvreg.geometry import se3
from mvreg.io.scan_names import meant
from mvreg.io.targets import Target, read_targets
from mvreg.types import Array

#: Targets spread across their longest line by less than this share of their spread along it say
#: too little of the rotation about it.
COLLINEAR = 0.02
#: A root mean square residual may be so large a part of the targets' own (about their centre).
LARGE = 0.01
#: A single target is to blame where without it the residual is so many times smaller.
BLAME = 5.0


@dataclass(frozen=True, eq=False)
class Targets:
    """Targets as measured in scans, or in the model, and where they are in the map.

    Parameters
    ----------
    measured, known : tuple of Target
    files : tuple of Path
        That they were read from, for messages.
    """

    measured: tuple[Target, ...]
    known: tuple[Target, ...]
    files: tuple[Path, Path]

    @classmethod
    def read(cls, measured: Path, known: Path) -> Targets:
        """Read both tables, see `read_targets`; of the map's each target counts once.

        Raises
        ------
        InputError
            Also where the map has a target in two places.
        """
        seen: dict[str, Target] = {}
        for target in read_targets(known):
            before = seen.setdefault(target.name, target)
            if not np.array_equal(before.position, target.position):
                raise InputError(
                    f"{known}, line {target.line}: target {target.name!r} is elsewhere in line "
                    f"{before.line}; expected one position of each in the frame of the map"
                )
        return cls(tuple(read_targets(measured)), tuple(seen.values()), (measured, known))

    def in_map(self, found: Placements) -> tuple[Placements, list[str]]:
        """The same placements in the frame of the map, and what is to be said.

        Each component comes there by its own targets: its poses are fitted to them as a whole,
        rigidly, without a scale. The first must have enough; another that has not stays where it
        is.

        Raises
        ------
        InputError
            Where there are too few targets, or they do not fit.
        """
        scans = self._scans(found)
        moved, said = [], []
        for component in found.components:
            names, model, world = self._pairs(component, scans)
            if component.number > 1 and len(names) < 3:
                said.append(f"component_{component.number} has no three targets: not in the map")
                moved.append(component)
                continue
            pose, more = fitted(names, model, world, f"{self.files[0]} and {self.files[1]}")
            poses = {name: pose @ each for name, each in component.poses.items()}
            moved.append(replace(component, poses=poses, reference=""))
            whose = f"component_{component.number}: " if component.number > 1 else ""
            said += [f"{whose}{each}" for each in more]
        return replace(found, components=tuple(moved)), said

    def _pairs(
        self, component: Component, scans: Mapping[str, str]
    ) -> tuple[list[str], Array, Array]:
        """Targets that both tables have, in the component's frame and in the map.

        One measured in several scans is at the mean of where these have it; one of no scan is in
        the frame of the first model.
        """
        poses = {scan: component.poses.get(name) for scan, name in scans.items()}
        poses[""] = np.eye(4) if component.number == 1 else None
        places: dict[str, list[Array]] = {}
        for target in self.measured:
            if (pose := poses[target.scan]) is not None:
                places.setdefault(target.name, []).append(se3.apply(pose, target.position))
        pairs = [(each.name, places[each.name], each.position)
                 for each in self.known if each.name in places]  # fmt: skip
        model = np.array([np.mean(positions, axis=0) for _, positions, _ in pairs]).reshape(-1, 3)
        world = np.array([position for _, _, position in pairs]).reshape(-1, 3)
        return [name for name, _, _ in pairs], model, world

    def _scans(self, found: Placements) -> dict[str, str]:
        """The run's names of the scans that targets were measured in, by the table's."""
        scans = dict.fromkeys(each.scan for each in self.measured if each.scan)
        known = {scan: meant(scan, found.names, str(self.files[0])) for scan in scans}
        unknown = sorted(scan for scan, name in known.items() if name is None)
        if unknown:
            raise InputError(
                f"{self.files[0]}: expected targets measured in the scans "
                f"{few(list(found.names))}; got {few(unknown)}"
            )
        return {scan: name for scan, name in known.items() if name is not None}


def fitted(names: Sequence[str], model: Array, world: Array, files: str) -> tuple[Array, list[str]]:
    """The rigid motion from the model to the map that fits targets best, and their residuals.

    Parameters
    ----------
    names : sequence of str
    model, world : (N, 3) arrays
        The targets in the model's frame and in the map's.
    files : str
        For messages.

    Returns
    -------
    pose : (4, 4) array
        ``T_map_model``.
    said : list of str
        The residuals, map minus model in the map's axes, and their root mean square.

    Raises
    ------
    InputError
        For fewer than three targets, for such on one line, for a frame that is mirrored or of
        another unit, and for residuals above a hundredth of the targets' spread: says which.
    """
    if len(names) < 3:
        raise InputError(f"{files}: expected three targets or more in both, got {few(names)}")
    along, across = np.linalg.svd(model - model.mean(axis=0), compute_uv=False)[:2]
    if not across > COLLINEAR * along:
        raise InputError(
            f"{files}: the targets {few(names)} are on one line, about which the model could be "
            "turned; measure one beside it"
        )
    pose, rms = _fit(model, world)
    spread = float(np.sqrt(((world - world.mean(axis=0)) ** 2).sum(axis=1).mean()))
    if rms > LARGE * spread:
        raise InputError(f"{files}: {_why(names, model, world, rms)}")
    if worst := _to_blame(names, model, world, rms, spread):
        raise InputError(f"{files}: {worst}")
    left = world - se3.apply(pose, model)
    said = [f"target {name}: {dx:.4g} {dy:.4g} {dz:.4g}, {np.linalg.norm((dx, dy, dz)):.4g} off"
            for name, (dx, dy, dz) in zip(names, left.tolist(), strict=True)]  # fmt: skip
    said.append(f"in the frame of the map by {len(names)} targets, RMS {rms:.4g}")
    if pose[2, 2] < 0:
        said.append(
            "the map's frame has the model upside down: are easting and northing in their columns?"
        )
    return pose, said


def _fit(model: Array, world: Array) -> tuple[Array, float]:
    """The motion, about the centres, as maps have large coordinates; and the RMS residual."""
    centre, there = model.mean(axis=0), world.mean(axis=0)
    turn = se3.fit(model - centre, world - there)
    shift = there + turn[:3, 3] - turn[:3, :3] @ centre
    pose = se3.from_parts(turn[:3, :3], shift)
    left = world - there - se3.apply(turn, model - centre)
    return pose, float(np.sqrt((left**2).sum(axis=1).mean()))


def _why(names: Sequence[str], model: Array, world: Array, rms: float) -> str:
    """What makes targets fit that do not: a mirror, a unit, or one of them left out."""
    told = f"the targets do not fit, RMS {rms:.4g}"
    if _fit(model * [-1, 1, 1], world)[1] < rms / BLAME:
        return f"{told}, but mirrored they do: are easting and northing in their columns?"
    sizes = [float(np.sqrt(((each - each.mean(axis=0)) ** 2).sum())) for each in (world, model)]
    factor = sizes[0] / sizes[1]
    if _fit(model * factor, world)[1] < rms / BLAME:
        return (
            f"{told}, but {factor:.6g} times as large they do: expected both in one unit of "
            "length; no scale is fitted"
        )
    return _to_blame(names, model, world, rms, 0.0) or f"{told}: {_apart(names, model, world)}"


def _to_blame(
    names: Sequence[str], model: Array, world: Array, rms: float, spread: float
) -> str | None:
    """The target without which the others fit, of five or more; residuals in rounding aside."""
    if len(names) < 5 or rms < 1e-3 * spread:
        return None
    rest = [_fit(np.delete(model, k, 0), np.delete(world, k, 0)) for k in range(len(names))]
    best = int(np.argmin([without for _, without in rest]))
    pose, without = rest[best]
    if without > rms / BLAME:
        return None
    off = float(np.linalg.norm(world[best] - se3.apply(pose, model[best])))
    return (
        f"target {names[best]} is {off:.4g} from where the others say, which fit to {without:.4g}: "
        "is it another one, or wrong in a table? Correct it or leave it out"
    )


def _apart(names: Sequence[str], model: Array, world: Array) -> str:
    """The two targets whose distance differs most."""
    gaps = [np.linalg.norm(each[:, None] - each[None], axis=2) for each in (model, world)]
    i, j = np.unravel_index(np.abs(gaps[0] - gaps[1]).argmax(), gaps[0].shape)
    return (
        f"{names[i]} and {names[j]} are {gaps[0][i, j]:.6g} apart in the model and "
        f"{gaps[1][i, j]:.6g} in the map"
    )
