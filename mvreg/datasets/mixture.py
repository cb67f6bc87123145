"""Scans of several objects, mixed; a method should keep the objects apart."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from mvreg.config.nested_dataset import load_named
from mvreg.datasets.amount import Amount
from mvreg.datasets.base import Order, ScanSource
from mvreg.errors import InputError
from mvreg.types import Array, Scan, ScanSet


@dataclass(frozen=True)
class Mixture(ScanSource):
    """Scans of several data sets, or some of one, shuffled and each moved at random.

    The truth holds the poses of each object in a frame of its own, and `ScanSet.objects` says
    which scan shows which.

    Parameters
    ----------
    of : list of str
        Names of data sets or presets, parameters of theirs may follow: ``bunny``, or
        ``"figurine shape=blob-0"``; required.
    keep : list of str
        How many scans of each are drawn at random, or of every one if there is but one entry:
        ``all``, a number as ``3``, a share as ``50%``, a range of these as ``2-5``.
    choose : str
        How many of the sets are drawn at random, in the same spelling.
    order : Order
        ``shuffle`` unless said otherwise.
    scramble : bool
        True unless said otherwise.
    """

    of: list[str] = field(default_factory=list)
    keep: list[str] = field(default_factory=lambda: ["all"])
    choose: str = "all"
    order: Order = Order.shuffle
    scramble: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.keep) not in (1, len(self.of)):
            raise InputError(
                f"dataset.keep={self.keep}: expected one entry, or one for each of the "
                f"{len(self.of)} sets in dataset.of={self.of}"
            )
        for text in self.keep:
            Amount("dataset.keep", text)
        Amount("dataset.choose", self.choose)

    @property
    def name(self) -> str:
        """What a mixture is called before its sets are drawn."""
        return "mixture"

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Draw the sets, load them, and draw from each.

        Raises
        ------
        InputError
            If a set cannot be loaded or has fewer scans than asked for; if two sets have scans of
            the same name or other units of length; if fewer than two scans are left.
        """
        if not self.of:
            raise InputError(
                "dataset=mixture needs the data sets to be mixed: 'dataset.of=[bunny,dragon]'"
            )
        keep = self.keep * len(self.of) if len(self.keep) == 1 else self.keep
        parts: list[ScanSet] = []
        for index in Amount("dataset.choose", self.choose).choose(len(self.of), rng, "sets"):
            found = load_named("dataset.of", self.of[index], rng)
            amount, things = Amount("dataset.keep", keep[index]), f"scans of {self.of[index]!r}"
            parts.append(_some(found, amount.choose(len(found.scans), rng, things)))
        return join(parts)


def _some(scans: ScanSet, chosen: list[int]) -> ScanSet:
    """Some of the scans, and what is known of these."""
    kept = tuple(scans.scans[index] for index in chosen)
    names = {scan.name for scan in kept}
    poses, objects = scans.poses, scans.objects
    return replace(
        scans,
        scans=kept,
        poses=None if poses is None else {n: T for n, T in poses.items() if n in names},
        objects=None if objects is None else {n: o for n, o in objects.items() if n in names},
        sensors={name: told for name, told in scans.sensors.items() if name in names},
    )


def join(parts: list[ScanSet]) -> ScanSet:
    """Several sets as one; each is an object of its own, or keeps those that it has.

    Raises
    ------
    InputError
        As `Mixture.load`.
    """
    scans = tuple(scan for part in parts for scan in part.scans)
    _check(parts, scans)
    poses: dict[str, Array] = {}
    objects: dict[str, str] = {}
    for part in parts:
        poses |= part.poses or {}
        own = part.objects or {scan.name: part.name for scan in part.scans}
        taken = set(objects.values())
        names = {each: _other(each, taken) for each in sorted(set(own.values()))}
        objects |= {scan: names[each] for scan, each in own.items()}
    name = "+".join(part.name for part in parts)
    motions = {scan: motion for part in parts for scan, motion in part.motions.items()}
    sensors = {scan: told for part in parts for scan, told in part.sensors.items()}
    remarks = tuple(dict.fromkeys(remark for part in parts for remark in part.remarks))
    return ScanSet(
        name, scans, parts[0].unit, poses or None, objects, motions, sensors, remarks
    )  # fmt: skip


def _check(parts: list[ScanSet], scans: tuple[Scan, ...]) -> None:
    """Refuse what cannot be one set of scans."""
    units = {part.name: part.unit for part in parts}
    if len(set(units.values())) > 1:
        shown = ", ".join(f"{name} in {unit}" for name, unit in units.items())
        raise InputError(f"dataset.of: expected sets in one unit of length, got {shown}")
    twice = [name for name, n in Counter(scan.name for scan in scans).items() if n > 1]
    if twice:
        raise InputError(
            f"dataset.of: expected scans with names of their own, got {', '.join(twice[:5])} "
            f"twice, in {', '.join(part.name for part in parts)}; mix sets without common names"
        )
    if len(scans) < 2:
        raise InputError(
            f"dataset=mixture: expected at least 2 scans, drew {len(scans)}; raise dataset.keep"
        )


def _other(name: str, taken: set[str]) -> str:
    """A name that is not taken: this one, or with a number."""
    names = [name, *(f"{name}_{number}" for number in range(2, len(taken) + 2))]
    return next(each for each in names if each not in taken)
