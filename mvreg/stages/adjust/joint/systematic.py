"""What scans get wrong together: errors that no averaging over neighbours takes away.

Points about a surface tell the noise that differs from point to point. How far the surfaces of
different scans are apart tells the rest: what bends a whole part of a scan, as beams that graze a
surface do. Its variance is a function of the incidence, estimated from the residuals (variance
components, as geodesists do: Forstner 1979; Amiri-Simkooei 2007).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mvreg.stages.adjust.joint.normal_equations import MAD
from mvreg.types import Array

#: Classes of incidence, as many contacts in each; pairs of classes with fewer contacts than this
#: say nothing.
CLASSES, FEWEST = 8, 50
#: Sweeps of coordinate descent: classes are few, and it converges in some dozen.
SWEEPS = 200


@dataclass(frozen=True, eq=False)
class Systematic:
    """Variances of the errors that the points of a cell share, by the incidence of the rays.

    Parameters
    ----------
    edges : (C - 1,) array
        Cosines between the classes, ascending.
    variances : (C,) array
        Of each class (length^2).
    """

    edges: Array
    variances: Array

    def at(self, cosines: Array) -> Array:
        """The variances (S,) for the cosines of incidences (S,) (length^2)."""
        found: Array = self.variances[np.searchsorted(self.edges, cosines)]
        return found


#: Nothing is wrong but noise.
NONE = Systematic(np.empty(0), np.zeros(1))


def systematic(source: Array, target: Array, residuals: Array, predicted: Array) -> Systematic:
    """What residuals (M,) scatter more than was `predicted` for them (M,), by incidence.

    Parameters
    ----------
    source, target : (M,) arrays
        Cosines of the incidence at both ends of each contact.
    residuals : (M,) array
        (length).
    predicted : (M,) array
        Variances (length^2).
    """
    edges = np.unique(np.quantile(np.append(source, target), np.arange(1, CLASSES) / CLASSES))
    edges = edges[edges < source.max(initial=0.0)]
    count = len(edges) + 1
    both = np.searchsorted(edges, source) * count + np.searchsorted(edges, target)
    squares = residuals**2
    normal, right = np.zeros((count, count)), np.zeros(count)
    order = np.argsort(both, kind="stable")
    bounds = np.searchsorted(both[order], np.arange(count * count + 1))
    for pair, (start, stop) in enumerate(pairwise(bounds)):
        if stop - start < FEWEST:
            continue
        mine = order[start:stop]
        row = np.zeros(count)
        np.add.at(row, [pair // count, pair % count], 1.0)
        more = MAD**2 * float(np.median(squares[mine])) - float(np.median(predicted[mine]))
        normal += (stop - start) * np.outer(row, row)
        right += (stop - start) * more * row
    return Systematic(edges, _not_negative(normal, right))


def _not_negative(normal: Array, right: Array) -> Array:
    """The least squares solution (C,) of normal equations among vectors that are not negative."""
    found = np.zeros(len(right))
    for _ in range(SWEEPS):
        for k, slope in enumerate(normal.diagonal()):
            if slope > 0:
                found[k] = max(0.0, found[k] + (right[k] - float(normal[k] @ found)) / slope)
    return found
