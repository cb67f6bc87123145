"""Residuals taken together by groups: how much the sums of groups vary, for each pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.kernels.normal_equations import group_sums
from mvreg.stages.adjust.joint.normal_equations import Rows, System
from mvreg.types import Array, Indices

#: Poses that nothing holds must not make a group's share of what holds them infinite.
RIDGE = 1e-9


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
    def of(cls, found: Rows, system: System, groups: Indices, width: float) -> Clusters:
        """Residuals with one of `groups` (M,) each, under the kernel of the `width`."""
        weights = found.weights
        parts = found.in_parts(
            lambda _, ends: group_sums(
                found.jacobian, found.residuals, weights, groups, ends, width
            )
        )
        counts = np.concatenate([np.diff(part.ends) for part in parts])
        names, numbers = np.unique(np.concatenate([p.groups for p in parts]), return_inverse=True)
        normals = np.concatenate([part.normals for part in parts])
        gradients = np.concatenate([part.gradients for part in parts])
        source, target = np.repeat(system.place[found.contacts.ways], counts, axis=0).T
        here, there = source >= 0, target >= 0
        free = len(system.gradient) // 6
        keys = np.append(numbers[here] * free + source[here], numbers[there] * free + target[there])
        keys, rows = np.unique(keys, return_inverse=True)
        information, slopes = np.zeros((len(keys), 6, 6)), np.zeros((len(keys), 6))
        np.add.at(information, rows, np.append(normals[here], normals[there], axis=0))
        np.add.at(slopes, rows, np.append(gradients[here], -gradients[there], axis=0))
        poses = keys % free
        whole = np.zeros((free, 6, 6))
        np.add.at(whole, poses, information)
        ridge = RIDGE * np.trace(whole, axis1=1, axis2=2) / 6
        inverse = np.linalg.inv(whole + np.where(ridge > 0, ridge, 1.0)[:, None, None] * np.eye(6))
        share = inverse[poses] @ information
        return cls(
            keys // free, poses, slopes, np.einsum("eij,eji->e", share, share),
            np.einsum("ei,eij,ej->e", slopes, inverse[poses], slopes), len(names), free,
        )  # fmt: skip

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


def in_cells(points: Array, edge: float) -> Indices:
    """The numbers (M,) of the cubes with the `edge` that points (M, 3) are in."""
    low, high = points.min(axis=0), points.max(axis=0)
    across = np.floor((high - low) / edge).astype(np.intp) + 1
    x, y, z = np.floor((points - low) / edge).astype(np.intp).T
    found: Indices = (x * across[1] + y) * across[2] + z
    return found
