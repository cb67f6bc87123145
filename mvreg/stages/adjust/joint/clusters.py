"""Residuals taken together by groups: how much the sums of groups vary, for each pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mvreg.kernels.normal_equations import group_sums
from mvreg.kernels.results import GroupSums
from mvreg.stages.adjust.joint.normal_equations import System
from mvreg.stages.adjust.joint.rows import Residuals, Rows
from mvreg.types import Array, Indices

#: Poses that nothing holds must not make a group's share of what holds them infinite.
RIDGE = 1e-9
#: Groups and poses worked on at once: products of their blocks fit into the cache of a core.
AT_ONCE = 2**12


@dataclass(frozen=True, eq=False)
class Clusters:
    """What each group of residuals says of each pose that it bears on; one row for each such pair.

    Parameters
    ----------
    groups, poses : (E,) arrays
        Which group, from 0 to `count`, and which of the free poses.
    gradients : (E, 6) array
    shares : (E,) array
        ``tr((A^-1 A_g)^2)`` for the information A of the pose and A_g of the group on it, at most
        6: what a group loses to the pose that is fitted to it (Bell and McCaffrey 2002).
    sizes : (E,) array
        ``g^T A^-1 g`` for the gradient g.
    count, free : int
        How many groups and free poses there are.
    """

    groups: Indices
    poses: Indices
    gradients: Array
    shares: Array
    sizes: Array
    count: int
    free: int

    @classmethod
    def of(
        cls, found: Rows | Residuals, system: System, groups: Callable[[Rows], Indices],
        width: float,
    ) -> Clusters:  # fmt: skip
        """Residuals in groups, under the kernel of the `width`.

        Of some of the rows (m,) `groups` says which each of them is in (m,).
        """
        free = len(system.gradient) // 6

        def tile_sums(tile: Rows) -> tuple[Indices, Array, Array]:
            sums = group_sums(
                tile.jacobian, tile.residuals, tile.weights, groups(tile), tile.contacts.ends,
                width,
            )  # fmt: skip
            return _by_pose(sums, system.place[tile.contacts.ways], free)

        keys, information, slopes = (
            np.concatenate(column) for column in zip(*found.in_tiles(tile_sums), strict=True)
        )
        keys, information, slopes = _added(keys, information, slopes)
        names, numbers = np.unique(keys // free, return_inverse=True)
        poses = keys % free
        shares, sizes = _shares(information, slopes, poses, free)
        return cls(numbers, poses, slopes, shares, sizes, len(names), free)

    @property
    def lost(self) -> float:
        """The share of the scatter of the groups' sums that the poses have taken out of them."""
        return min(float(self.shares.sum()) / (6 * self.free), 1.0)

    @property
    def variance(self) -> float:
        """Of residuals in units of what each is expected to be, as the groups' sums tell it."""
        return float(self.sizes.sum()) / (6 * self.free) / max(1 - self.lost, RIDGE)

    def modes(self) -> Array:
        """(F, 6, G): the gradients of the groups, with what the fit has taken out of them."""
        found = np.zeros((self.count, self.free, 6))
        found[self.groups, self.poses] = self.gradients / np.sqrt(max(1 - self.lost, RIDGE))
        return np.moveaxis(found, 0, 2)


def _by_pose(sums: GroupSums, place: Indices, free: int) -> tuple[Indices, Array, Array]:
    """Sums of ways between poses `place` (W, 2), as sums of each pose and group: see `_added`.

    A negative place is that of a pose that is held.
    """
    source, target = np.repeat(place, np.diff(sums.ends), axis=0).T
    here, there = source >= 0, target >= 0
    return _added(
        np.append(
            free * sums.groups[here] + source[here], free * sums.groups[there] + target[there]
        ),
        np.append(sums.normals[here], sums.normals[there], axis=0),
        np.append(sums.gradients[here], -sums.gradients[there], axis=0),
    )


def _added(keys: Indices, normals: Array, slopes: Array) -> tuple[Indices, Array, Array]:
    """What has the same key (K,) added up: keys ascending, and sums (E, 6, 6) and (E, 6)."""
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    first = np.flatnonzero(np.diff(keys, prepend=-1))
    if not len(first):
        return keys, normals, slopes
    return (
        keys[first], np.add.reduceat(normals[order], first), np.add.reduceat(slopes[order], first),
    )  # fmt: skip


def _shares(information: Array, slopes: Array, poses: Indices, free: int) -> tuple[Array, Array]:
    """The `shares` and `sizes` of `Clusters`."""
    whole = np.zeros((free, 6, 6))
    np.add.at(whole, poses, information)
    ridge = RIDGE * np.trace(whole, axis1=1, axis2=2) / 6
    inverse = np.linalg.inv(whole + np.where(ridge > 0, ridge, 1.0)[:, None, None] * np.eye(6))
    shares, sizes = np.empty(len(poses)), np.empty(len(poses))
    for first in range(0, len(poses), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        of_pose = inverse[poses[part]]
        share = of_pose @ information[part]
        shares[part] = np.einsum("eij,eji->e", share, share)
        sizes[part] = np.einsum("ei,eij,ej->e", slopes[part], of_pose, slopes[part])
    return shares, sizes


@dataclass(frozen=True)
class Cells:
    """Cubes with an `edge` from the corner `low` (3,) on, so many `across` (3,)."""

    low: Array
    across: Indices
    edge: float

    @classmethod
    def about(cls, found: Rows | Residuals, edge: float) -> Cells:
        """Those that all the rows are in."""
        low, high = found.box
        return cls(low, np.floor((high - low) / edge).astype(np.intp) + 1, edge)

    def __call__(self, some: Rows) -> Indices:
        """The numbers (m,) of the cells that rows (m,) are in."""
        x, y, z = np.floor((some.points - self.low) / self.edge).astype(np.intp).T
        found: Indices = (x * self.across[1] + y) * self.across[2] + z
        return found
