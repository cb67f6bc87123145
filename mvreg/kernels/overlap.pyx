# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Where the points of one scan lie on the surface of another, and in which box they do."""

from libc.math cimport fabs

from mvreg.kernels.linear cimport Motion, dot, move, of_array, plane_height, turn
from mvreg.kernels.tree cimport Tree

import numpy as np

from mvreg.kernels import checks


def contact_heights(
    Tree tree not None, planes, points, normals, transform, double reach, double least_cosine
):
    """Where points lie on a surface, and how far from its planes.

    Parameters as in `mvreg.kernels.evidence.directed_evidence`; signs of normals do not matter.

    Returns
    -------
    which : (M,) array
        Positions among the points, ascending.
    heights : (M,) array
        Distances from the planes (length).
    """
    cdef const double[:, ::1] given = checks.floats("points", points, "P", 3)
    cdef const double[:, ::1] own = checks.floats("normals", normals, given.shape[0], 3)
    cdef const double[:, ::1] other = checks.floats("planes", planes, tree.n, 3)
    cdef Py_ssize_t count = given.shape[0], found = 0, i, partner
    cdef double x[3]
    cdef double turned[3]
    cdef double squared, cosine
    cdef const double* plane
    cdef Motion motion
    of_array(checks.transform("transform", transform), motion)
    which, heights = np.empty(count, dtype=np.intp), np.empty(count)
    cdef Py_ssize_t[::1] place = which
    cdef double[::1] height = heights
    with nogil:
        for i in range(count):
            move(motion, &given[i, 0], x)
            squared = reach * reach
            partner = tree.find(x, &squared)
            if partner < 0:
                continue
            plane = &other[partner, 0]
            turn(motion, &own[i, 0], turned)
            cosine = dot(turned, plane)
            if not fabs(cosine) > least_cosine:
                continue
            place[found] = i
            height[found] = fabs(plane_height(x, &tree.cloud[partner, 0], plane))
            found += 1
    return which[:found].copy(), heights[:found].copy()


def box(points, transform):
    """The least and largest coordinates (3,) of points (N, 3) that are moved."""
    cdef const double[:, ::1] given = checks.floats("points", points, "N", 3)
    cdef Py_ssize_t i
    cdef double x[3]
    cdef int k
    cdef Motion motion
    of_array(checks.transform("transform", transform), motion)
    lowest, highest = np.full(3, np.inf), np.full(3, -np.inf)
    cdef double[::1] low = lowest, high = highest
    with nogil:
        for i in range(given.shape[0]):
            move(motion, &given[i, 0], x)
            for k in range(3):
                if x[k] < low[k]:
                    low[k] = x[k]
                if x[k] > high[k]:
                    high[k] = x[k]
    return lowest, highest
