"""What contacts are worth: of each sample and patch a few numbers, of a contact none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.stages.adjust.joint.correspondences import Contacts
from mvreg.types import Array, Indices


def places(begin: Indices, found: Contacts) -> tuple[Indices, Indices]:
    """(M,), (M,): where the samples and the patches of contacts are in those of all surfaces.

    `begin` (N + 1,) is where those of each surface begin.
    """
    sources, targets = np.repeat(begin[found.ways], found.counts, axis=0).T
    return sources + found.samples, targets + found.patches


@dataclass(frozen=True, eq=False)
class Trust:
    """What contacts are worth, and how far apart noise leaves their surfaces.

    Parameters
    ----------
    begin : (N + 1,) array
        Where the samples of each surface begin, and where those of the last one end.
    cells : (T, 2) array
        Of each sample a weight, and the variance of its cell's mean (length^2).
    fits : (T, 3) array
        Of each patch a weight, the variance of its points over their number, and that of what it
        does not follow (length^2).
    """

    begin: Indices
    cells: Array
    fits: Array

    def weights(self, found: Contacts) -> Array:
        """(M,): those of the contacts (1 / length^2), a sample's times a patch's."""
        samples, patches = places(self.begin, found)
        weights: Array = self.cells[samples, 0] * self.fits[patches, 0]
        return weights

    def variances(self, found: Contacts, aside: Array) -> Array:
        """Variances (M,) of the distances of cells from patches (length^2).

        A cell has the variance of a mean. That of a patch of second order, ``(4 - 8 t + 18 t^2) /
        n`` of a point's for n points spread evenly over a disc, depends on how far from its middle
        it is asked: t is `aside` (M,), the squared distance in units of the radius.
        """
        samples, patches = places(self.begin, found)
        variances: Array = (4 - aside * (8 - 18 * aside)) * self.fits[patches, 1]
        variances += self.cells[samples, 1]
        variances += self.fits[patches, 2]
        return variances
