# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""The curved patches of a surface, asked for distances."""

from libc.math cimport sqrt
from libc.string cimport memcpy
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport of_array
from mvreg.kernels.tree cimport Tree

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks
from mvreg.kernels.results import Gaps


cdef class Patches:
    """The patches of one surface, side by side in memory; for their meaning see `Surface`.

    Parameters
    ----------
    tree : Tree
        Of the points.
    points, normals : (S, 3) arrays
    axes : (S, 3, 3) array
    slopes : (S, 2) array
    bends : (S, 3) array
    reach : (S,) array
    whole, usable : (S,) arrays of bool
        Whether the patch serves, and whether the cell does.
    means : (S, 3) array
    seconds : (S, 3, 3) array
    """

    def __cinit__(
        self, Tree tree not None, points, axes, slopes, bends, normals, reach, whole, usable, means,
        seconds
    ):
        # What is found in the tree is looked up among the patches.
        cdef const double[:, ::1] points_ = checks.floats("points", points, tree.n, 3)
        cdef const double[:, :, ::1] axes_ = checks.floats("axes", axes, tree.n, 3, 3)
        cdef const double[:, ::1] slopes_ = checks.floats("slopes", slopes, tree.n, 2)
        cdef const double[:, ::1] bends_ = checks.floats("bends", bends, tree.n, 3)
        cdef const double[:, ::1] normals_ = checks.floats("normals", normals, tree.n, 3)
        cdef const double[::1] reach_ = checks.floats("reach", reach, tree.n)
        cdef const unsigned char[::1] whole_ = checks.flags("whole", whole, tree.n)
        cdef const unsigned char[::1] usable_ = checks.flags("usable", usable, tree.n)
        cdef const double[:, ::1] means_ = checks.floats("means", means, tree.n, 3)
        cdef const double[:, :, ::1] seconds_ = checks.floats("seconds", seconds, tree.n, 3, 3)
        cdef Py_ssize_t k
        cdef Patch* one
        self.tree = tree
        self.size = points_.shape[0]
        self.patch.resize(self.size)
        for k in range(self.size):
            one = &self.patch[k]
            memcpy(one.point, &points_[k, 0], 3 * sizeof(double))
            memcpy(one.axes, &axes_[k, 0, 0], 9 * sizeof(double))
            memcpy(one.slope, &slopes_[k, 0], 2 * sizeof(double))
            memcpy(one.bend, &bends_[k, 0], 3 * sizeof(double))
            memcpy(one.normal, &normals_[k, 0], 3 * sizeof(double))
            memcpy(one.mean, &means_[k, 0], 3 * sizeof(double))
            memcpy(one.second, &seconds_[k, 0, 0], 9 * sizeof(double))
            one.reach, one.whole, one.usable = reach_[k], whole_[k], usable_[k]

    def arrays(self):
        """What it was made of but for the tree, in the order of the parameters; copies."""
        cdef Py_ssize_t k
        cdef double[:, ::1] given = np.empty((self.size, 33))
        cdef unsigned char[:, ::1] flags = np.empty((self.size, 2), dtype=np.uint8)
        for k in range(self.size):  # a patch begins with 33 numbers
            memcpy(&given[k, 0], &self.patch[k], 33 * sizeof(double))
            flags[k, 0], flags[k, 1] = self.patch[k].whole, self.patch[k].usable
        points, axes, slopes, bends, normals, reach, means, seconds = (
            part.copy() for part in np.split(np.asarray(given), [3, 12, 14, 17, 20, 21, 24], axis=1)
        )
        whole, usable = np.asarray(flags).astype(bool).T
        return (
            points, axes.reshape(-1, 3, 3), slopes, bends, normals, reach[:, 0], whole, usable,
            means, seconds.reshape(-1, 3, 3),
        )


def gaps(Patches surface not None, points, patches, bint flat):
    """How far points are from patches, across the surface and along it.

    Parameters
    ----------
    surface : Patches
    points : (M, 3) array
    patches : (M,) array
        One for each point.
    flat : bool
        Ask the tangent planes instead.

    Returns
    -------
    Gaps
    """
    cdef const double[:, ::1] given = checks.floats("points", points, "M", 3)
    cdef const Py_ssize_t[::1] which = checks.indices("patches", patches, surface.size, "M")
    cdef Py_ssize_t size = which.shape[0], k
    if given.shape[0] != size:
        raise ValueError(f"expected points for {size} patches, got {given.shape[0]}")
    heights, normals, aside = np.empty(size), np.empty((size, 3)), np.empty(size)
    cdef double[::1] high = heights, far = aside
    cdef double[:, ::1] normal = normals
    with nogil:
        for k in range(size):
            high[k] = height(&surface.patch[which[k]], &given[k, 0], flat, &normal[k, 0], &far[k])
            far[k] = sqrt(far[k])
    return Gaps(heights, normals, aside)


cdef Patches one_of(surfaces, Py_ssize_t k):
    surface = surfaces[k]
    if not isinstance(surface, Patches):
        raise TypeError(f"surfaces: expected Patches, got {type(surface).__name__} at {k}")
    return surface


cdef vector[double] placed(motions, Py_ssize_t count) except *:
    """The motions of so many surfaces, twelve numbers each."""
    cdef const double[:, :, ::1] given = checks.floats("motions", motions, count, 4, 4)
    cdef vector[double] found
    cdef Py_ssize_t k
    found.resize(12 * count)
    for k in range(count):
        of_array(given[k], &found[12 * k])
    return found


cdef int check_ends(Py_ssize_t ends, Py_ssize_t ways) except -1:
    """That there are ends of so many ways."""
    if ends != ways + 1:
        raise InputError(f"expected the ends of {ways} ways, got {ends} numbers")
    return 0


cdef int check_inside(
    const int* samples, const int* patches, Py_ssize_t size, Py_ssize_t sources, Py_ssize_t targets
) except -1 nogil:
    """That contacts are among so many samples and patches."""
    cdef Py_ssize_t k
    for k in range(size):
        if not (0 <= samples[k] < sources and 0 <= patches[k] < targets):
            with gil:
                raise ValueError(
                    f"expected positions among {sources} samples and {targets} patches, "
                    f"got {samples[k]} and {patches[k]}")
    return 0
