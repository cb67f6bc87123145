# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
"""What the other kernels need of the patches of a surface."""

from libc.math cimport sqrt
from libcpp.vector cimport vector

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


cdef class Patches:
    cdef Tree tree
    cdef vector[Patch] patch
    cdef Py_ssize_t size


cdef Patches one_of(surfaces, Py_ssize_t k)
cdef vector[double] placed(motions, Py_ssize_t count) except *


cdef inline double height(
    const Patch* patch, const double* x, bint flat, double* normal, double* aside
) noexcept nogil:
    """How far a point is from a patch; the surface's normal there; how far along it (squared)."""
    return height_of_cell(patch, x, NULL, flat, normal, aside)


cdef inline double height_of_cell(
    const Patch* patch, const double* x, const double* spread, bint flat, double* normal,
    double* aside
) noexcept nogil:
    """`height` of the mean of points with a covariance (9 numbers), averaged over them.

    The mean of points on a curved surface is off it; by so much do their own mean heights differ
    from the height of their mean.
    """
    cdef double local[3]
    cdef double gap[3]
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
            below += (patch.bend[0] * product(patch.axes, spread, patch.axes)
                      + 2 * patch.bend[1] * product(patch.axes, spread, patch.axes + 3)
                      + patch.bend[2] * product(patch.axes + 3, spread, patch.axes + 3)) / 2
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


cdef inline double product(const double* a, const double* matrix, const double* b) noexcept nogil:
    """``a^T M b`` of a symmetric matrix (9 numbers)."""
    return (a[0] * (matrix[0] * b[0] + matrix[1] * b[1] + matrix[2] * b[2])
            + a[1] * (matrix[3] * b[0] + matrix[4] * b[1] + matrix[5] * b[2])
            + a[2] * (matrix[6] * b[0] + matrix[7] * b[1] + matrix[8] * b[2]))


cdef inline void turned_covariance(
    const double* motion, const double* covariance, double* turned
) noexcept nogil:
    """``R C R^T`` (9 numbers)."""
    cdef int i, j
    for i in range(3):
        for j in range(3):
            turned[3 * i + j] = product(motion + 3 * i, covariance, motion + 3 * j)


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
