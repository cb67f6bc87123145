# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
"""What the other kernels need of the patches of a surface."""

from libc.math cimport sqrt
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport dot, turn_back
from mvreg.kernels.tree cimport Tree

cdef struct Patch:
    double point[3]
    double axes[9]
    double slope[2]
    double bend[3]
    double normal[3]
    double reach
    double mean[3]
    double second[9]
    bint whole
    bint usable


cdef class Patches:
    cdef Tree tree
    cdef vector[Patch] patch
    cdef Py_ssize_t size


cdef Patches one_of(surfaces, Py_ssize_t k)
cdef vector[double] placed(motions, Py_ssize_t count) except *
cdef int check_ends(Py_ssize_t ends, Py_ssize_t ways) except -1
cdef int check_inside(
    const int* samples, const int* patches, Py_ssize_t size, Py_ssize_t sources, Py_ssize_t targets
) except -1 nogil


cdef inline double height(
    const Patch* patch, const double* x, bint flat, double* normal, double* aside
) noexcept nogil:
    """How far a point is from a patch; the surface's normal there; how far along it (squared)."""
    return height_of_cell(patch, x, NULL, NULL, flat, normal, aside)


cdef inline double height_of_cell(
    const Patch* patch, const double* x, const double* spread, const double* motion, bint flat,
    double* normal, double* aside
) noexcept nogil:
    """`height` of the mean of points with a covariance (9 numbers), averaged over them.

    The covariance is in the frame that the motion leads from.

    The mean of points on a curved surface is off it; by so much do their own mean heights differ
    from the height of their mean.
    """
    cdef double local[3]
    cdef double gap[3]
    cdef double along[6]
    cdef double wide[6]
    cdef double a, b, below, first = patch.slope[0], second = patch.slope[1], bent, other, shallow
    cdef int m
    for m in range(3):
        gap[m] = x[m] - patch.point[m]
    for m in range(3):
        local[m] = (patch.axes[3 * m] * gap[0] + patch.axes[3 * m + 1] * gap[1]
                    + patch.axes[3 * m + 2] * gap[2])
    a, b = local[0], local[1]
    # h(a, b) = s . (a, b) + c . (a^2 / 2, a b, b^2 / 2), and its gradient.
    below = first * a + second * b
    if not flat:
        bent = patch.bend[0] * a + patch.bend[1] * b
        other = patch.bend[1] * a + patch.bend[2] * b
        below += (bent * a + other * b) / 2
        if spread != NULL:
            for m in range(2):
                turn_back(motion, patch.axes + 3 * m, along + 3 * m)
                times(spread, along + 3 * m, wide + 3 * m)
            below += (patch.bend[0] * dot(along, wide) + 2 * patch.bend[1] * dot(along + 3, wide)
                      + patch.bend[2] * dot(along + 3, wide + 3)) / 2
        first, second = first + bent, second + other
    # The distance to F = z - h(a, b) = 0 to first order, F / |grad F| (Taubin 1991); the axes need
    # not be orthogonal.
    for m in range(3):
        normal[m] = patch.axes[6 + m] - first * patch.axes[m] - second * patch.axes[3 + m]
    shallow = 1 / sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    for m in range(3):
        normal[m] *= shallow
    aside[0] = a * a + b * b
    return shallow * (local[2] - below)


cdef inline void times(const double* matrix, const double* x, double* product) noexcept nogil:
    """A matrix (9 numbers) times a vector."""
    cdef int i
    for i in range(3):
        product[i] = matrix[3 * i] * x[0] + matrix[3 * i + 1] * x[1] + matrix[3 * i + 2] * x[2]


cdef inline void between(
    const double* from_source, const double* from_target, double* motion
) noexcept nogil:
    """``T_target_source``."""
    cdef int i, j, m
    for i in range(3):
        for j in range(3):
            motion[3 * i + j] = 0
            for m in range(3):
                motion[3 * i + j] += from_target[3 * m + i] * from_source[3 * m + j]
        motion[9 + i] = 0
        for m in range(3):
            motion[9 + i] += from_target[3 * m + i] * (from_source[9 + m] - from_target[9 + m])
