# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Points of a scan that others hide from a sensor: the evidence of where it stood."""

from libc.math cimport fabs, floor
from libc.stdint cimport int64_t, uint64_t
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport cross, dot, norm

import numpy as np

from mvreg.kernels import checks

# Of vectors shorter than this times another the direction is lost in rounding.
cdef double SHORT = 1e-6


cdef struct Pixel:
    int64_t key
    double top


def hidden(points, directions, landmark, double cell, double depth):
    """Shares (D,) of points (N, 3) that others hide from a sensor far away in each direction.

    A point is hidden by one of the same cell of the picture that is so much nearer.

    Parameters
    ----------
    points : (N, 3) array
    directions : (D, 3) array
        Unit, towards the sensor.
    landmark : (3,) array
        Says how pictures lie: at right angles to it, where it is not along the direction.
    cell, depth : float
        Lengths, positive.
    """
    cdef const double[:, ::1] given = checks.floats("points", points, "N", 3, finite=True)
    cdef const double[:, ::1] wanted = checks.floats("directions", directions, "D", 3, finite=True)
    cdef const double[::1] mark = checks.floats("landmark", landmark, 3, finite=True)
    cdef Py_ssize_t count = given.shape[0], i, d, behind
    cdef uint64_t mask = 1, at
    cdef vector[Pixel] table
    cdef vector[uint64_t] slot
    cdef vector[int64_t] across, along
    cdef vector[double] heights
    cdef int64_t least_across, least_along, most_along, key
    cdef double axes[9]
    cdef const double* x
    cdef Pixel none
    found = np.zeros(wanted.shape[0])
    cdef double[::1] share = found
    checks.positive(cell=cell)
    none.key, none.top = -1, 0
    while mask < <uint64_t> (2 * count):
        mask *= 2
    mask -= 1
    slot.resize(count)
    across.resize(count)
    along.resize(count)
    heights.resize(count)
    with nogil:
        for d in range(wanted.shape[0]):
            axes_across(&wanted[d, 0], &mark[0], axes)
            table.assign(mask + 1, none)
            for i in range(count):
                x = &given[i, 0]
                across[i] = <int64_t> floor(dot(axes, x) / cell)
                along[i] = <int64_t> floor(dot(&axes[3], x) / cell)
                heights[i] = dot(&axes[6], x)
                if i == 0:
                    least_across, least_along, most_along = across[0], along[0], along[0]
                least_across = min(least_across, across[i])
                least_along = min(least_along, along[i])
                most_along = max(most_along, along[i])
            for i in range(count):
                key = <int64_t> (
                    <uint64_t> (across[i] - least_across) * <uint64_t> (most_along - least_along + 1)
                    + <uint64_t> (along[i] - least_along) & <uint64_t> 0x7FFFFFFFFFFFFFFF
                )
                at = (<uint64_t> key * <uint64_t> 0x9E3779B97F4A7C15) >> 20 & mask
                while table[at].key >= 0 and table[at].key != key:
                    at = (at + 1) & mask
                if table[at].key < 0 or heights[i] > table[at].top:
                    table[at].key, table[at].top = key, heights[i]
                slot[i] = at
            behind = 0
            for i in range(count):
                if table[slot[i]].top - heights[i] > depth:
                    behind += 1
            share[d] = <double> behind / <double> count if count else 0
    return found


cdef void axes_across(const double* direction, const double* landmark, double* axes) noexcept nogil:
    """Rows: a unit vector at right angles to a direction and a landmark, another, the direction."""
    cdef double other[3]
    cdef double length
    cdef int k, least = 0
    cross(direction, landmark, axes)
    length = norm(axes)
    if not length > SHORT * norm(landmark):
        for k in range(1, 3):
            if fabs(direction[k]) < fabs(direction[least]):
                least = k
        for k in range(3):
            other[k] = 1.0 if k == least else 0.0
        cross(direction, other, axes)
        length = norm(axes)
    for k in range(3):
        axes[k] /= length
        axes[6 + k] = direction[k]
    cross(direction, axes, &axes[3])
