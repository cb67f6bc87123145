# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""The nearest descriptors of one view for those of another, to begin matches with."""

from libc.math cimport INFINITY, sqrt

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks


cdef class Rows:
    """Rows (N, D), N at least 1, in the order of the column that varies most.

    Parameters
    ----------
    rows : (N, D) array
    """

    cdef Py_ssize_t axis
    cdef const Py_ssize_t[::1] ranked
    cdef const double[:, ::1] ascending

    def __cinit__(self, rows):
        given = checks.floats("rows", rows, "N", "D", finite=True)
        if not given.size:
            raise InputError(f"rows: expected one or more, of one number or more, got {given.shape}")
        self.axis = given.var(axis=0).argmax()
        order = np.argsort(given[:, self.axis], kind="stable")
        self.ranked, self.ascending = order, given[order]

    def nearest(self, queries):
        """The nearest row to each of queries (M, D).

        Along the column that varies most: once that gap alone is too wide the search is over.

        Returns
        -------
        distances, indices : (M,) arrays
            The first of those equally near.
        """
        cdef const double[:, ::1] asked = checks.floats(
            "queries", queries, "M", self.ascending.shape[1], finite=True)
        cdef const double[:, ::1] ascending = self.ascending
        cdef Py_ssize_t size = ascending.shape[0], length = ascending.shape[1], axis = self.axis
        cdef Py_ssize_t i, j, k, best, up, down
        cdef double least, total, gap
        distances, indices = np.empty(asked.shape[0]), np.empty(asked.shape[0], dtype=np.intp)
        cdef double[::1] far = distances
        cdef Py_ssize_t[::1] which = indices
        cdef const Py_ssize_t[::1] start = np.searchsorted(
            np.asarray(ascending)[:, axis], np.asarray(asked)[:, axis])
        with nogil:
            for i in range(asked.shape[0]):
                least, best, up, down = INFINITY, -1, start[i], start[i] - 1
                while up < size or down >= 0:
                    if up < size and (down < 0 or ascending[up, axis] - asked[i, axis]
                                      <= asked[i, axis] - ascending[down, axis]):
                        j = up
                        up += 1
                    else:
                        j = down
                        down -= 1
                    gap = ascending[j, axis] - asked[i, axis]
                    if gap * gap > least:
                        break
                    total, k = 0, 0
                    while k < length and total <= least:
                        gap = asked[i, k] - ascending[j, k]
                        total += gap * gap
                        k += 1
                    if total < least or (total == least and (best < 0 or self.ranked[j] < best)):
                        least, best = total, self.ranked[j]
                far[i], which[i] = sqrt(least), best
        return distances, indices
