"""What all data sets have in common: order of the scans, random motions, what scans are told."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from mvreg.datasets.initial import tell_initial
from mvreg.datasets.sensors import AUTO, check_sensor, tell_sensor, tell_upright
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.types import Array, ScanSet


class Order(Enum):
    """In which order the scans are handed over."""

    given = "given"
    shuffle = "shuffle"


@dataclass(frozen=True)
class ScanSource:
    """A data set; subclasses say what to `load`, and have a `name` as field or property.

    Parameters
    ----------
    order : Order
        ``given``: as the files are ordered; ``shuffle``: at random.
    scramble : bool
        Apply an unknown rigid motion to every scan, as if each had been taken from anywhere.
        Sensors and verticals move with their scans, and the ground truth follows.
    sensor : str
        Where the sensor of every scan was, in the frame that the scan has before it is moved.
        ``auto``: what the files or the data set say, if they say it; ``unknown``: nothing, even
        if they do; ``origin``: at the origin of the scan's coordinates (a view point); ``+x``,
        ``-x``, ``+y``, ``-y``, ``+z``, ``-z``: far away in this direction, as seen from the
        surface (a view direction).
    initial : str
        Poses known beforehand, from somewhere else: a file of ``T_world_scan`` as
        `mvreg.io.read_poses` takes it, or ``file`` for those that the scans' own files have. They
        are tried beside whatever registration finds, and judged as that is.
    fixed : list of str
        Scans that keep their pose of `initial`, or that of their file, or the identity if there is
        neither; the others come to them, into their frame.
    upright : bool
        The scanner was levelled: the vertical of every scan is +z in the frame that it has before
        it is moved. Poses between such scans keep to it.
    """

    order: Order = Order.given
    scramble: bool = False
    sensor: str = AUTO
    upright: bool = False
    initial: str = ""
    fixed: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "order", Order(self.order))
        except ValueError:
            options = ", ".join(order.value for order in Order)
            raise InputError(f"dataset.order={self.order!r}: expected one of {options}") from None
        check_sensor(self.sensor)

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Find the scans, in their given order and where they are; for subclasses to define."""
        raise NotImplementedError(f"{type(self).__name__} does not define load()")

    def __call__(self, rng: np.random.Generator) -> ScanSet:
        """Load, tell sensors, vertical and initial poses, then shuffle and scramble as asked.

        Raises
        ------
        InputError
            If the scans cannot be found or read.
        """
        scans = tell_sensor(self.load(rng), self.sensor)
        if self.upright:
            scans = tell_upright(scans)
        if self.initial or self.fixed:
            scans = tell_initial(scans, self.initial, self.fixed)
        if self.order is Order.shuffle:
            chosen = rng.permutation(len(scans.scans))
            scans = replace(scans, scans=tuple(scans.scans[i] for i in chosen))
        return scramble(scans, rng) if self.scramble else scans


def scramble(scans: ScanSet, rng: np.random.Generator) -> ScanSet:
    """Move every scan at random: any rotation, and a translation of up to the scan's extent.

    The ground truth stays true: ``T_world_new = T_world_scan @ inv(T_new_scan)``.
    """
    motions = {
        scan.name: se3.random(rng, shift=float(np.ptp(scan.points, axis=0).max()))
        for scan in scans.scans
    }
    return replace(
        scans,
        scans=tuple(scan.moved(motions[scan.name]) for scan in scans.scans),
        poses=None if scans.poses is None else {
            name: _follow(pose, motions.get(name)) for name, pose in scans.poses.items()
        },
        motions=scans.as_read(motions),
        initial={name: _follow(T, motions.get(name)) for name, T in scans.initial.items()},
    )  # fmt: skip


def _follow(pose: Array, motion: Array | None) -> Array:
    return pose if motion is None else pose @ se3.invert(motion)
