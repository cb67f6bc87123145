# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
"""The row of one contact, for other kernels."""

from mvreg.kernels.linear cimport cross, move, turn
from mvreg.kernels.patches cimport Patch, height_of_cell

# What rows are asked about, and in which unit (its inverse).
cdef struct About:
    double centre[3]
    double unit
    bint flat


cdef inline double gap_of(
    const Patch* cell, const Patch* patch, const double* into, bint flat, double* x, double* inward,
    double* aside
) noexcept nogil:
    """How far the mean of a cell is from a patch, averaged over the cell (length).

    And where it is, and the surface's normal there, in the patch's frame; and how far along the
    patch, in units of how far that reaches, squared.
    """
    cdef double height
    move(into, cell.mean, x)
    height = height_of_cell(patch, x, cell.second, into, flat, inward, aside)
    aside[0] /= patch.reach * patch.reach if patch.reach > 0 else 1.0
    return height


cdef inline void row_of(
    const double* from_target, const double* x, const double* inward, const About* about, double* p,
    double* row
) noexcept nogil:
    """How a gap changes with the source's motion, and where it is.

    Point to plane, with the plane that touches the surface below the point (Chen and Medioni 1992):
    for a small turn and shift of the source ``J = [p x n, n]``, with n the surface's normal and
    ``p = (x - centre) / R``.
    """
    cdef int m
    turn(from_target, inward, row + 3)
    move(from_target, x, p)
    for m in range(3):
        p[m] = (p[m] - about.centre[m]) * about.unit
    cross(p, row + 3, row)
