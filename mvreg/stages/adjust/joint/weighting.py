"""How much each contact of two surfaces says, and how far apart noise alone leaves the two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.geometry.ragged import ends_of
from mvreg.kernels import way_sums
from mvreg.stages.adjust.joint.correspondences import Contacts
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.stages.adjust.joint.systematic import Systematic
from mvreg.stages.adjust.joint.trust import Trust, places
from mvreg.types import Array, Indices

#: What a patch does not follow is wrong over so much of it, as a share: relief changes its sign.
#: From 0.1 to 0.3 the error on `figurine`'s gnome is the same within a tenth; with 0 it is twice
#: as large at a noise of a fifth of the spacing, with 1 relief that is noise is thrown away.
RELIEF = 0.2


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
        return places(self.begin, found)


def plainly(known: Pooled, found: Contacts, stride: int) -> Trust:
    """Contacts weighted as if all points were as good, but for those seen at a grazing angle.

    For poses that are far off, where residuals say nothing of noise. The squared cosine of the
    incidence takes what is left against the ``.conf`` poses of Bunny, Dragon and Buddha down by a
    fifth, a tenth and an eighth.
    """
    precision = known.density * known.cosines**2
    ones, zeros = np.ones(len(precision)), np.zeros((len(precision), 2))
    return _shared(known, found, stride, precision, precision, ones, zeros)


def by_noise(known: Pooled, found: Contacts, stride: int, wrong: Systematic) -> Trust:
    """Contacts weighted by what is known of the surface there (1 / length^2)."""
    variance = known.noise + known.usual * wrong.at(known.cosines)  # cells share an error
    relief = RELIEF * known.fitted * known.misfit
    source, target = known.density / variance, known.density / (variance + relief)
    return _shared(known, found, stride, source, target, *_variances(known, wrong))


def predicted(known: Pooled, found: Contacts, aside: Array, wrong: Systematic) -> Array:
    """`Trust.variances`, of contacts that are not weighted yet."""
    cells, fits = _variances(known, wrong)
    ones = np.ones(len(cells))
    trust = Trust(known.begin, np.column_stack([ones, cells]), np.column_stack([ones, fits]))
    return trust.variances(found, aside)


def _variances(known: Pooled, wrong: Systematic) -> tuple[Array, Array]:
    """Of cells (T,), and of patches (T, 2): see `Trust`."""
    shared = wrong.at(known.cosines)
    cells = known.noise / known.counts + shared
    return cells, np.column_stack([known.noise / known.fitted, shared + known.misfit])


def _shared(
    known: Pooled, found: Contacts, stride: int, source: Array, target: Array, cells: Array,
    fits: Array,
) -> Trust:  # fmt: skip
    """The weights that make the most of what all scans know of a surface, and variances.

    Where scans k, each with a precision of q_k per area, lie on the same unknown surface, least
    squares over the poses and the surface leave, once the surface is eliminated, the weight
    ``q_i q_j / sum_k q_k`` per area to the gap between i and j. A sample of i stands for the area
    of its cell; both ways count a half each. Thus nothing that three scans agree on is counted
    three times.
    """
    total = way_sums.known_at(
        found.ways, found.ends, found.samples, found.patches, known.begin,
        np.column_stack([source, target]),
    )  # fmt: skip
    shared = np.divide(known.area * source, total, out=np.zeros(len(total)), where=total > 0)
    return Trust(
        known.begin, np.column_stack([stride / 2 * shared, cells]), np.column_stack([target, fits])
    )
