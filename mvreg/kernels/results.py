"""What the kernels answer, by name; each is a tuple as well."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from mvreg.geometry.arrays import Array, Indices, Places


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


class Moments(NamedTuple):
    """Sums over the points within each of some radii of keypoints.

    Parameters
    ----------
    counts : (K, L) array
        How many there are.
    first : (K, L, 3) array
        Sums of their offsets from the keypoint.
    second : (K, L, 3, 3) array
        Sums of the offsets' outer products.
    """

    counts: Array
    first: Array
    second: Array


class FittedPatches(NamedTuple):
    """Patches of second order about samples, ``height(a, b)`` over the first two of their axes.

    Every point that a patch rests on is in the cell of one sample.

    Parameters
    ----------
    heights : (S,) array
        At the samples (length).
    slopes : (S, 2) array
    bends : (S, 3) array
        Second derivatives (1 / length).
    reach : (S,) array
        How far the points reach along the patch (length).
    lopsided : (S,) array
        How far off the sample their mean is along the patch, in units of `reach`; 0 for a reach
        of 0.
    radius : (S,) array
        How far the points are from the sample, at most (length).
    variance : (S,) array
        Of the points' heights about the patch, with six degrees of freedom spent (length^2).
    counts : (S,) array
        How many points the cell of each sample has.
    means : (S, 3) array
        Of these; the sample where there are none.
    seconds : (S, 3, 3) array
        Their covariance (length^2).
    """

    heights: Array
    slopes: Array
    bends: Array
    reach: Array
    lopsided: Array
    radius: Array
    variance: Array
    counts: Array
    means: Array
    seconds: Array


class Gaps(NamedTuple):
    """How far points are from patches.

    Parameters
    ----------
    heights : (M,) array
        Signed distances to the surface, to first order (length).
    normals : (M, 3) array
        Of the surface below the points, unit.
    aside : (M,) array
        How far the points are from the middle of the patch, along it (length).
    """

    heights: Array
    normals: Array
    aside: Array


class PatchContacts(NamedTuple):
    """Samples on patches, those of one way (an ordered pair of surfaces) after those of another.

    Parameters
    ----------
    ends : (W + 1,) array
        Where the contacts of each way begin, and where those of the last one end.
    samples, patches : (M,) arrays
        Positions in the source and in the target, samples ascending within a way.
    """

    ends: Indices
    samples: Places
    patches: Places


class NormalEquations(NamedTuple):
    """Of each way: ``J^T W J`` (W, 6, 6), and ``J^T W r`` (W, 6)."""

    normals: Array
    gradients: Array


class GroupSums(NamedTuple):
    """Normal equations of groups of residuals, those of one way after those of another.

    Parameters
    ----------
    ends : (W + 1,) array
        Where the groups of each way begin, and where those of the last one end.
    groups : (C,) array
        Numbers of the groups of which a way has residuals, ascending within a way.
    normals : (C, 6, 6) array
        ``J^T W J``.
    gradients : (C, 6) array
        ``J^T W r``.
    """

    ends: Indices
    groups: Indices
    normals: Array
    gradients: Array
