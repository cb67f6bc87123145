# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Sums over the points about a keypoint, for several radii at once; and normals of neighbours."""

from libc.math cimport fabs, sqrt

from mvreg.kernels.linear cimport smallest_vector
from mvreg.kernels.tree cimport Entry, Tree, child_distances

import numpy as np

from mvreg.kernels import checks
from mvreg.kernels.results import Moments

# Radii asked for at once, sums for each (count, three first moments, six second), neighbours.
cdef enum:
    MOST = 64
    SUMS = 10
    NEIGHBOURS = 128


def moments(Tree tree not None, keypoints, radii):
    """Moments of a tree's points around keypoints, for growing radii, in one pass.

    Parameters
    ----------
    tree : Tree
    keypoints : (K, 3) array
    radii : (L,) array
        Ascending, positive, at most 64 of them. A point as far away as a radius is within it.

    Returns
    -------
    Moments
    """
    cdef const double[:, ::1] points = checks.floats("keypoints", keypoints, "K", 3)
    cdef const double[::1] squared = checks.floats("radii", radii, "L") ** 2
    cdef Py_ssize_t size = points.shape[0], shells = squared.shape[0], i
    if not 0 < shells <= MOST:
        raise ValueError(f"expected 1 to {MOST} radii, got {shells}")
    sums = np.zeros((size, shells, SUMS))
    cdef double[:, :, ::1] total = sums
    with nogil:
        for i in range(size):
            gather(tree, &points[i, 0], &squared[0], shells, &total[i, 0, 0])
    sums = np.cumsum(sums, axis=1)
    upper = np.array([[4, 5, 6], [5, 7, 8], [6, 8, 9]])
    return Moments(sums[..., 0], sums[..., 1:4], sums[..., upper])


cdef void gather(
    Tree tree, const double* x, const double* squared, Py_ssize_t shells, double* sums
) noexcept nogil:
    """Add every point within the largest radius to the sums of its shell."""
    cdef Py_ssize_t waiting[128]
    cdef double apart[2]
    cdef Py_ssize_t node, i, last, shell
    cdef double most = squared[shells - 1], a, b, c, d
    cdef double* one
    cdef Entry* entry
    cdef int held = 1
    if tree.n == 0:
        return
    waiting[0] = 1
    while held:
        held -= 1
        node = waiting[held]
        if node < tree.leaves:
            child_distances(tree.boxes, node, x, apart)
            waiting[held] = 2 * node + 1
            held += apart[1] <= most
            waiting[held] = 2 * node
            held += apart[0] <= most
            continue
        i = (tree.n * (node - tree.leaves)) >> tree.depth
        last = (tree.n * (node - tree.leaves + 1)) >> tree.depth
        while i < last:
            entry = &tree.entries[i]
            i += 1
            a, b, c = entry.x[0] - x[0], entry.x[1] - x[1], entry.x[2] - x[2]
            d = a * a + b * b + c * c
            if d > most:
                continue
            shell = 0
            while d > squared[shell]:
                shell += 1
            one = &sums[SUMS * shell]
            one[0] += 1
            one[1] += a
            one[2] += b
            one[3] += c
            one[4] += a * a
            one[5] += a * b
            one[6] += a * c
            one[7] += b * b
            one[8] += b * c
            one[9] += c * c


def normals(Tree tree not None, queries, int count):
    """Unit normals of planes through the nearest neighbours (principal components).

    Parameters
    ----------
    tree : Tree
    queries : (M, 3) array
    count : int
        How many neighbours, 1 to 128; all points of the tree if it has fewer.

    Returns
    -------
    (M, 3) array
        Of undetermined sign; some unit vector where neighbours make no plane.
    """
    cdef const double[:, ::1] points = checks.floats("queries", queries, "M", 3)
    cdef Py_ssize_t size = points.shape[0], i
    if not 0 < count <= NEIGHBOURS:
        raise ValueError(f"expected 1 to {NEIGHBOURS} neighbours, got {count}")
    found = np.empty((size, 3))
    cdef double[:, ::1] normal = found
    with nogil:
        for i in range(size):
            plane(tree, &points[i, 0], count, &normal[i, 0])
    return found


cdef void plane(Tree tree, const double* x, int count, double* normal) noexcept nogil:
    """The normal of the plane through the neighbours of one point."""
    cdef double squared[NEIGHBOURS]
    cdef Py_ssize_t which[NEIGHBOURS]
    cdef const double[:, ::1] data = tree.cloud
    cdef double mean[3]
    cdef double gap[3]
    cdef double a[9]
    cdef int i, j, k
    squared[count - 1] = 1e300
    count = tree.find_many(x, count, squared, which)
    for j in range(3):
        mean[j] = 0
    for i in range(count):
        for j in range(3):
            mean[j] += (data[which[i], j] - x[j]) / count
    for j in range(9):
        a[j] = 0
    for i in range(count):
        for j in range(3):
            gap[j] = data[which[i], j] - x[j] - mean[j]
        for j in range(3):
            for k in range(3):
                a[3 * j + k] += gap[j] * gap[k]
    smallest_vector(a, normal)
