"""The residuals of contacts, and how they change with the poses: all of them, or tile by tile."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mvreg.kernels import residuals as kernel
from mvreg.parallel import Answer, in_threads
from mvreg.stages.adjust.joint.correspondences import Contacts
from mvreg.stages.adjust.joint.frame import Frame
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.stages.adjust.joint.trust import Trust
from mvreg.types import Array


class Tiled(ABC):
    """Residuals of contacts, of which some ways at a time are looked at."""

    contacts: Contacts
    unit: Array

    @property
    def weights(self) -> Array:
        """(M,): those of the contacts, for residuals in these units."""
        return self.contacts.weights * self.unit**2

    @abstractmethod
    def tile(self, part: slice) -> Rows:
        """The rows of consecutive ways."""

    def in_tiles(self, function: Callable[[Rows], Answer]) -> list[Answer]:
        """What a function says of the rows of some ways at a time; see `Contacts.in_tiles`."""
        return in_threads(lambda part: function(self.tile(part)), self.contacts.parts())


@dataclass(frozen=True, eq=False)
class Rows(Tiled):
    """The residuals of contacts under some poses.

    Parameters
    ----------
    contacts : Contacts
    residuals : (M,) array
        In units of `unit`.
    jacobian : (M, 6) array
        For the pose of a contact's source, and its negative for that of its target.
    points : (M, 3) array
        Where they are, in units of the frame's radius.
    aside : (M,) array
        How far along the patches, in units of their reach, squared.
    unit : (M,) array
        What residuals are in units of (length).
    """

    contacts: Contacts
    residuals: Array
    jacobian: Array
    points: Array
    aside: Array
    unit: Array

    @property
    def lengths(self) -> Array:
        """(M,): the residuals as lengths."""
        return self.residuals * self.unit

    @property
    def box(self) -> tuple[Array, Array]:
        """(3,), (3,): between which corners the points are."""
        return self.points.min(axis=0), self.points.max(axis=0)

    def whitened(self, deviations: Array, residuals: Array | None = None) -> Rows:
        """The same in units of what each residual is expected to be (M,), a length.

        In these units the `residuals` (M,) may be others.
        """
        change = self.unit / deviations
        return replace(
            self,
            residuals=self.residuals * change if residuals is None else residuals,
            jacobian=self.jacobian * change[:, None],
            unit=deviations,
        )

    def expected(self, trust: Trust) -> Rows:
        """The same in units of what `trust` expects of each."""
        return self.whitened(np.sqrt(trust.variances(self.contacts, self.aside)))

    def tile(self, part: slice) -> Rows:
        """The rows of consecutive ways."""
        mine = self.contacts.rows(part)
        return Rows(
            self.contacts.tile(part), self.residuals[mine], self.jacobian[mine],
            self.points[mine], self.aside[mine], self.unit[mine],
        )  # fmt: skip


def rows(
    surfaces: Sequence[Surface], motions: Array, contacts: Contacts, frame: Frame, flat: bool
) -> Rows:
    """Point-to-surface residuals of all contacts, in units of the frame's radius."""
    made, fill = _blank(contacts, frame), _filling(surfaces, motions, frame, flat)
    made.in_tiles(fill)
    return made


def _blank(contacts: Contacts, frame: Frame) -> Rows:
    """Room for rows in units of the frame's radius."""
    size = len(contacts.samples)
    return Rows(
        contacts, np.empty(size), np.empty((size, 6)), np.empty((size, 3)),
        np.empty(size), np.full(size, frame.radius),
    )  # fmt: skip


def _filling(
    surfaces: Sequence[Surface], motions: Array, frame: Frame, flat: bool
) -> Callable[[Rows], None]:
    """What fills rows."""
    patches = [surface.patches for surface in surfaces]

    def fill(tile: Rows) -> None:
        some = tile.contacts
        kernel.rows(
            patches, motions, some.ways, some.ends, some.samples, some.patches,
            frame.centre, frame.radius, flat,
            tile.residuals, tile.jacobian, tile.points, tile.aside,
        )  # fmt: skip

    return fill


#: Of so many contacts all rows are kept, 180 MB of them; of more they are made again whenever they
#: are asked for. Of 150 scans around the figurine, with 2.9 million contacts, the refinement has
#: 1,011 MB at its most then instead of 1,651; of 100, with 1.7 million, it
#: took 8.2 s instead of 6.3.
KEPT = 2**21


@dataclass(frozen=True, eq=False)
class Residuals(Tiled):
    """The residuals of contacts, as `Rows` has them, of which the rows are made when asked for.

    Of millions of contacts all rows at once would take several times the memory of all else.

    Parameters
    ----------
    contacts : Contacts
    residuals, unit : (M,) arrays
        See `Rows`.
    made : callable
        The rows of some of the contacts, in any unit.
    box : two (3,) arrays
        See `Rows`.
    """

    contacts: Contacts
    residuals: Array
    unit: Array
    made: Callable[[Contacts], Rows]
    box: tuple[Array, Array]

    @classmethod
    def of(
        cls, surfaces: Sequence[Surface], motions: Array, contacts: Contacts, trust: Trust,
        frame: Frame,
    ) -> Rows | Residuals:  # fmt: skip
        """In units of what is expected of each, weighted as `trust` says; rows, where few."""
        filled = _filling(surfaces, motions, frame, flat=False)

        def made(tile: Contacts) -> Rows:
            blank = _blank(tile, frame)
            filled(blank)
            return blank

        size = len(contacts.samples)
        weights, residuals, unit = np.empty(size), np.empty(size), np.empty(size)

        def fill(part: slice) -> tuple[Array, Array]:
            mine, tile = contacts.rows(part), contacts.tile(part)
            weights[mine] = trust.weights(tile)
            apart = made(tile)
            white = apart.expected(trust)
            residuals[mine], unit[mine] = white.residuals, white.unit
            return apart.box

        low, high = zip(*in_threads(fill, contacts.parts()), strict=True)
        box = np.min(low, axis=0), np.max(high, axis=0)
        found = cls(replace(contacts, weights=weights), residuals, unit, made, box)
        return found.whole() if size <= KEPT else found

    def tile(self, part: slice) -> Rows:
        """The rows of consecutive ways."""
        mine = self.contacts.rows(part)
        made = self.made(self.contacts.tile(part))
        return made.whitened(self.unit[mine], self.residuals[mine])

    def whole(self) -> Rows:
        """All rows at once."""
        parts = self.in_tiles(lambda tile: (tile.jacobian, tile.points, tile.aside))
        jacobian, points, aside = (np.concatenate(column) for column in zip(*parts, strict=True))
        return Rows(self.contacts, self.residuals, jacobian, points, aside, self.unit)
