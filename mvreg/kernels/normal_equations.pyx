# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Residuals summed up: to robust normal equations, and to gradients in cells of space."""

from libc.math cimport floor
from libc.stdint cimport int64_t
from libc.string cimport memcpy, memset
from libcpp.algorithm cimport sort
from libcpp.utility cimport pair
from libcpp.vector cimport vector

import numpy as np

from mvreg.kernels import checks
from mvreg.kernels.results import CellSums, NormalEquations


def normal_equations(jacobian, residuals, weights, ends, double width):
    """The weighted sums ``J^T W J`` and ``J^T W r`` over each way's rows.

    Parameters
    ----------
    jacobian : (M, 6) array
    residuals, weights : (M,) arrays
        Each weight is multiplied by ``(1 - u^2)^2`` for a residual u below 1 in units of the width,
        and by 0 for others: that of Tukey's biweight (Beaton and Tukey 1974) in iteratively
        reweighted least squares.
    ends : (W + 1,) array
        Where the rows of each way begin, and where those of the last one end.
    width : float
        Residuals beyond it have no weight.

    Returns
    -------
    NormalEquations
    """
    cdef const double[:, ::1] row = checks.floats("jacobian", jacobian, "M", 6)
    cdef Py_ssize_t size = row.shape[0], w
    cdef const double[::1] residual = checks.floats("residuals", residuals, size)
    cdef const double[::1] weight = checks.floats("weights", weights, size)
    cdef const Py_ssize_t[::1] end = checks.ends("ends", ends, size)
    cdef Py_ssize_t count = end.shape[0] - 1
    normals, gradients = np.zeros((count, 6, 6)), np.zeros((count, 6))
    cdef double[:, :, ::1] normal = normals
    cdef double[:, ::1] gradient = gradients
    if size == 0:
        return NormalEquations(normals, gradients)
    with nogil:
        for w in range(count):
            add(end[w], end[w + 1], &row[0, 0], &residual[0], &weight[0], width,
                &normal[w, 0, 0], &gradient[w, 0])
    return NormalEquations(normals, gradients)


cdef void add(
    Py_ssize_t first, Py_ssize_t last, const double* jacobian, const double* residuals,
    const double* weights, double width, double* normal, double* gradient
) noexcept nogil:
    """Add rows to sums that are zero."""
    cdef double sums[36]
    cdef double slopes[6]
    cdef double square, share, slope
    cdef const double* row
    cdef Py_ssize_t k
    cdef int m, n
    memset(sums, 0, sizeof(sums))
    memset(slopes, 0, sizeof(slopes))
    for k in range(first, last):
        square = (residuals[k] / width) * (residuals[k] / width)
        if not square < 1:
            continue
        share = weights[k] * ((1 - square) * (1 - square))
        row = jacobian + 6 * k
        for m in range(6):
            slope = share * row[m]
            slopes[m] += slope * residuals[k]
            for n in range(m + 1):
                sums[6 * m + n] += slope * row[n]
    for m in range(6):
        gradient[m] = slopes[m]
        for n in range(m + 1):
            normal[6 * m + n] = normal[6 * n + m] = sums[6 * m + n]


def cell_sums(jacobian, residuals, weights, points, ends, double width, low, double edge, across):
    """The gradients ``J^T W r`` of each way's residuals in every cell of a grid, weighted as above.

    The scores of clusters, of which a covariance that allows for correlation within them is made
    (Liang and Zeger 1986).

    Parameters
    ----------
    jacobian, residuals, weights, ends, width
        As in `normal_equations`.
    points : (M, 3) array
        Where the residuals are.
    low : (3,) array
        Where the grid begins: no point is lower.
    edge : float
        Of its cells.
    across : (3,) array
        How many cells there are along x, y, z.

    Returns
    -------
    CellSums
    """
    cdef const double[:, ::1] row = checks.floats("jacobian", jacobian, "M", 6)
    cdef Py_ssize_t rows = row.shape[0], w, k, one
    cdef const double[::1] residual = checks.floats("residuals", residuals, rows)
    cdef const double[::1] weight = checks.floats("weights", weights, rows)
    cdef const double[:, ::1] point = checks.floats("points", points, rows, 3)
    cdef const double[::1] start = checks.floats("low", low, 3)
    cdef const int64_t[::1] size = checks.floats("across", across, 3, finite=True).astype(np.int64)
    cdef const Py_ssize_t[::1] end = checks.ends("ends", ends, rows)
    cdef Py_ssize_t count = end.shape[0] - 1
    cdef vector[pair[int64_t, Py_ssize_t]] order
    cdef vector[int64_t] cells
    cdef vector[double] sums
    cdef double square, share
    cdef double* slopes = NULL
    cdef int64_t key
    cdef int m
    checks.positive(edge=edge)
    last = np.zeros(count + 1, dtype=np.intp)
    cdef Py_ssize_t[::1] last_ = last
    with nogil:
        for w in range(count):
            order.resize(end[w + 1] - end[w])
            for k in range(end[w], end[w + 1]):
                key = 0
                for m in range(3):
                    key = key * size[m] + <int64_t> floor((point[k, m] - start[m]) / edge)
                order[k - end[w]].first, order[k - end[w]].second = key, k
            sort(order.begin(), order.end())
            for k in range(end[w + 1] - end[w]):
                one = order[k].second
                if k == 0 or order[k].first != order[k - 1].first:
                    cells.push_back(order[k].first)
                    sums.resize(6 * cells.size(), 0.0)
                    slopes = &sums[6 * cells.size() - 6]
                square = (residual[one] / width) * (residual[one] / width)
                if square < 1:
                    share = weight[one] * residual[one] * ((1 - square) * (1 - square))
                    for m in range(6):
                        slopes[m] += share * row[one, m]
            last_[w + 1] = cells.size()
    found = np.empty(cells.size(), dtype=np.int64), np.empty((cells.size(), 6))
    cdef int64_t[::1] cell = found[0]
    cdef double[:, ::1] sum_ = found[1]
    if cells.size():
        memcpy(&cell[0], cells.data(), cells.size() * sizeof(int64_t))
        memcpy(&sum_[0, 0], sums.data(), sums.size() * sizeof(double))
    return CellSums(last, *found)
