"""What the kernels answer, by name; each is a tuple as well."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from mvreg.geometry.arrays import Array, Indices


class TrimmedPairs(NamedTuple):
    """The nearest neighbours that trimming keeps, nearest first.

    Parameters
    ----------
    chosen, targets : (P,) arrays
        Positions of the points kept, and of their neighbours in the tree.
    distances : (P,) array
        Between them (length).
    psi : float
        Eq. (4): mean squared distance over a power of the overlap (length^2).
    bound : float
        How far neighbours had to be looked for (length).
    """

    chosen: Indices
    targets: Indices
    distances: Array
    psi: float
    bound: float


class Registration(NamedTuple):
    """Where iterations of closest points ended: ``T_target_source``, and its pairs."""

    transform: Array
    pairs: TrimmedPairs
    iterations: int
    converged: bool


class Sight(NamedTuple):
    """What the points of a scan show on the surface of another, and before what was seen there.

    With p about the ball's centre (length), the points' own unit normals n, the planes' m turned
    into the moving frame, and signed heights h over these planes (length), sums are over those met.

    Parameters
    ----------
    in_contact : (P,) array of bool
        The points on the surface, normals agreeing.
    near, consistent, front : int
        Points that near, whatever their normals; those on what the sensor saw, and before it.
    squared : float
        Sum of ``h^2``.
    first : (3,) array
        Sum of p.
    second : float
        Sum of ``p^2``.
    cross_information, information : (6, 6) arrays
        Sums of the products of ``[p x n, n]`` and ``[p x m, m]``, and of the latter and itself.
    gradient : (6,) array
        Sum of ``h [p x m, m]``.
    """

    in_contact: NDArray[np.bool_]
    near: int
    consistent: int
    front: int
    squared: float
    first: Array
    second: float
    cross_information: Array
    information: Array
    gradient: Array
