# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""The occupied cells of a grid, and what is in them."""

from libc.math cimport INFINITY, floor
from libc.stdint cimport int64_t, uint64_t
from libcpp.algorithm cimport sort
from libcpp.utility cimport pair
from libcpp.vector cimport vector

import numpy as np

from mvreg.kernels import checks

cdef int64_t MOST = 0x7FFFFFFFFFFFFFFF

# Places in the table of cells at first: for two points each, but no more than so many.
cdef enum:
    FIRST = 1
    MUCH = 16384


cdef inline uint64_t slot_of(const vector[int64_t]& table, int64_t key, uint64_t mask) noexcept nogil:
    """Where a cell is in the table, or would be."""
    cdef uint64_t slot = (<uint64_t> key * <uint64_t> 0x9E3779B97F4A7C15) >> 20 & mask
    while table[slot] >= 0 and table[slot] != key:
        slot = (slot + 1) & mask
    return slot


cdef void fill(
    vector[int64_t]& table, vector[Py_ssize_t]& owner, const vector[int64_t]& keys, uint64_t mask
) noexcept nogil:
    """A larger table of the same cells."""
    cdef size_t i
    cdef uint64_t slot
    table.assign(mask + 1, -1)
    owner.resize(mask + 1)
    for i in range(keys.size()):
        slot = slot_of(table, keys[i], mask)
        table[slot] = keys[i]
        owner[slot] = i


cdef class Cells:
    """The occupied cells of a grid over points (N, 3), in the order of their places along x, y, z.

    The grid begins at the least coordinates of the points, so that it moves with them.

    Parameters
    ----------
    points : (N, 3) array
        Finite.
    step : float
        Edge of the cells (length), positive; so large that the cells along an edge of the points'
        box can be counted.

    Attributes
    ----------
    sizes : (C,) array
        How many points each cell holds.
    means : (C, 3) array
        Their means.
    cell : (N,) array
        The cell of each point.
    """

    cdef readonly object sizes
    cdef readonly object means
    cdef readonly object cell

    def __cinit__(self, points, double step):
        cdef const double[:, ::1] given = checks.floats("points", points, "N", 3, finite=True)
        cdef Py_ssize_t count = given.shape[0], i, k, found, place
        cdef double low[3]
        cdef int64_t most[3]
        cdef int64_t at[3]
        cdef uint64_t mask, slot
        cdef int64_t key
        cdef vector[int64_t] keys, table
        cdef vector[Py_ssize_t] owner, rank
        cdef vector[pair[int64_t, Py_ssize_t]] order
        checks.positive(step=step)
        cell = np.empty(count, dtype=np.intp)
        cdef Py_ssize_t[::1] of = cell
        for k in range(3):
            low[k], most[k] = INFINITY, 0
        with nogil:
            for i in range(count):
                for k in range(3):
                    if given[i, k] < low[k]:
                        low[k] = given[i, k]
            for i in range(count):
                for k in range(3):
                    at[k] = <int64_t> floor((given[i, k] - low[k]) / step)
                    if at[k] > most[k]:
                        most[k] = at[k]
            # Of large scans cells are far fewer than points: the table grows with them.
            mask = FIRST
            while mask < <uint64_t> (2 * count) and mask < MUCH:
                mask *= 2
            table.resize(mask, -1)
            mask -= 1
            owner.resize(mask + 1)
            found = 0
            for i in range(count):
                key = <int64_t> floor((given[i, 0] - low[0]) / step)
                key = key * (most[1] + 1) + <int64_t> floor((given[i, 1] - low[1]) / step)
                key = key * (most[2] + 1) + <int64_t> floor((given[i, 2] - low[2]) / step)
                key = key & MOST  # a grid too fine to be counted may fuse cells, and that is all
                slot = slot_of(table, key, mask)
                if table[slot] < 0:
                    table[slot] = key
                    owner[slot] = found
                    keys.push_back(key)
                    found += 1
                    if <uint64_t> (2 * found) > mask:
                        mask = 2 * mask + 1
                        fill(table, owner, keys, mask)
                        slot = slot_of(table, key, mask)
                of[i] = owner[slot]
            order.resize(found)
            rank.resize(found)
            for i in range(found):
                order[i].first, order[i].second = keys[i], i
            sort(order.begin(), order.end())
            for i in range(found):
                rank[order[i].second] = i
        sizes, means = np.zeros(found, dtype=np.intp), np.zeros((found, 3))
        cdef Py_ssize_t[::1] size = sizes
        cdef double[:, ::1] mean = means
        with nogil:
            for i in range(count):
                place = rank[of[i]]
                of[i] = place
                size[place] += 1
                for k in range(3):
                    mean[place, k] += given[i, k]
            for i in range(found):
                for k in range(3):
                    mean[i, k] /= size[i]
        self.sizes, self.means, self.cell = sizes, means, cell
