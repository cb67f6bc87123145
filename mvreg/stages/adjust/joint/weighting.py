"""How much each contact of two surfaces says, and how far apart noise alone leaves the two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mvreg.geometry.ragged import ends_of
from mvreg.stages.adjust.joint.correspondences import Contacts
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.stages.adjust.joint.systematic import Systematic
from mvreg.types import Array, Indices

#: What a patch does not follow is wrong over so much of it, as a share: relief changes its sign.
#: From 0.1 to 0.3 the error on `figurine`'s gnome is the same within a tenth; with 0 it is twice
#: as large at a noise of a fifth of the spacing, with 1 relief that is noise is thrown away.
RELIEF = 0.1


@dataclass(frozen=True, eq=False)
class Pooled:
    """What is known at the samples of all surfaces, in a row: each (S,), see `Surface`."""

    begin: Indices
    density: Array
    counts: Array
    area: Array
    usual: Array
    fitted: Array
    noise: Array
    misfit: Array
    cosines: Array

    @classmethod
    def of(cls, surfaces: Sequence[Surface]) -> Pooled:
        """The samples of one surface after those of another.

        `area` is that of a sample's cell (length^2), `usual` how many points cells have in the mean
        of the surface.
        """
        sizes = [len(surface.points) for surface in surfaces]
        density = np.concatenate([surface.density for surface in surfaces])
        counts = np.concatenate([surface.counts for surface in surfaces])
        return cls(
            begin=ends_of(np.array(sizes)),
            density=density,
            counts=np.maximum(counts, 1),
            area=np.divide(counts, density, out=np.zeros(len(density)), where=density > 0),
            usual=np.repeat([float(surface.counts.mean()) for surface in surfaces], sizes),
            fitted=np.repeat([float(surface.fitted) for surface in surfaces], sizes),
            noise=np.concatenate([surface.noise for surface in surfaces]),
            misfit=np.concatenate([surface.misfit for surface in surfaces]),
            cosines=np.concatenate([surface.cosines for surface in surfaces]),
        )

    def places(self, found: Contacts) -> tuple[Indices, Indices]:
        """(M,), (M,): where the samples and the patches of contacts are in the row."""
        sources, targets = np.repeat(self.begin[found.ways], found.counts, axis=0).T
        return sources + found.samples, targets + found.patches


def plainly(known: Pooled, found: Contacts, stride: int) -> Contacts:
    """Contacts weighted as if all points were as good, but for those seen at a grazing angle.

    For poses that are far off, where residuals say nothing of noise. The squared cosine of the
    incidence takes what is left against the ``.conf`` poses of Bunny, Dragon and Buddha down by a
    fifth, a tenth and an eighth.
    """
    precision = known.density * known.cosines**2
    return _shared(known, found, stride, precision, precision)


def by_noise(known: Pooled, found: Contacts, stride: int, wrong: Systematic) -> Contacts:
    """Contacts weighted by what is known of the surface there (1 / length^2)."""
    variance = known.noise + known.usual * wrong.at(known.cosines)  # cells share an error
    relief = RELIEF * known.fitted * known.misfit
    source, target = known.density / variance, known.density / (variance + relief)
    return _shared(known, found, stride, source, target)


def predicted(known: Pooled, found: Contacts, aside: Array, wrong: Systematic) -> Array:
    """Variances (M,) of the distances of cells from patches (length^2).

    A cell has the variance of a mean. That of a patch of second order, ``(4 - 8 t + 18 t^2) / n``
    of a point's for n points spread evenly over a disc, depends on how far from its middle it is
    asked: t is `aside` (M,), the squared distance in units of the radius.
    """
    samples, patches = known.places(found)
    shared = wrong.at(known.cosines)
    cells = known.noise / known.counts + shared
    variances = (4 - aside * (8 - 18 * aside)) * (known.noise / known.fitted)[patches]
    variances += cells[samples]
    variances += (shared + known.misfit)[patches]
    return variances


def _shared(
    known: Pooled, found: Contacts, stride: int, source: Array, target: Array
) -> Contacts:  # fmt: skip
    """Contacts with the weights that make the most of what all scans know of a surface.

    Where scans k, each with a precision of q_k per area, lie on the same unknown surface, least
    squares over the poses and the surface leave, once the surface is eliminated, the weight
    ``q_i q_j / sum_k q_k`` per area to the gap between i and j. A sample of i stands for the area
    of its cell; both ways count a half each. Thus nothing that three scans agree on is counted
    three times.
    """
    samples, patches = known.places(found)
    there = target[patches]
    total = source + np.bincount(samples, there, len(source))
    shared = np.divide(known.area * source, total, out=np.zeros(len(total)), where=total > 0)
    weights = stride / 2 * shared[samples] * there
    return replace(found, weights=weights)
