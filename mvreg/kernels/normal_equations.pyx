# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Residuals summed up to robust normal equations: of each way, and of groups in each way."""

from libc.string cimport memcpy
from libcpp.algorithm cimport sort
from libcpp.utility cimport pair
from libcpp.vector cimport vector

import numpy as np

from mvreg.kernels import checks
from mvreg.kernels.results import GroupSums, NormalEquations


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
    """The sums over some rows."""
    cdef Sums sums
    cdef double square
    cdef Py_ssize_t k
    clear(&sums)
    for k in range(first, last):
        square = (residuals[k] / width) * (residuals[k] / width)
        if not square < 1:
            continue
        add_row(&sums, jacobian + 6 * k, weights[k] * ((1 - square) * (1 - square)), residuals[k])
    write(&sums, normal, gradient)


def group_sums(jacobian, residuals, weights, groups, ends, double width):
    """The sums ``J^T W J`` and ``J^T W r`` of each way's residuals by group, weighted as above.

    The scores of clusters, of which a covariance that allows for correlation within them is made
    (Liang and Zeger 1986), and the information of each.

    Parameters
    ----------
    jacobian, residuals, weights, ends, width
        As in `normal_equations`.
    groups : (M,) array
        The number of the group of each residual.

    Returns
    -------
    GroupSums
    """
    cdef const double[:, ::1] row = checks.floats("jacobian", jacobian, "M", 6)
    cdef Py_ssize_t rows = row.shape[0], w, k, one, first, last, size
    cdef const double[::1] residual = checks.floats("residuals", residuals, rows)
    cdef const double[::1] weight = checks.floats("weights", weights, rows)
    cdef const Py_ssize_t[::1] group = checks.integers("groups", groups, rows)
    cdef const Py_ssize_t[::1] end = checks.ends("ends", ends, rows)
    cdef Py_ssize_t count = end.shape[0] - 1
    cdef vector[pair[Py_ssize_t, Py_ssize_t]] order
    cdef vector[Py_ssize_t] names
    cdef vector[double] sums, sorted_rows, sorted_residuals, sorted_weights
    bounds = np.zeros(count + 1, dtype=np.intp)
    cdef Py_ssize_t[::1] bound = bounds
    with nogil:
        for w in range(count):
            size = end[w + 1] - end[w]
            order.resize(size)
            sorted_rows.resize(6 * size)
            sorted_residuals.resize(size)
            sorted_weights.resize(size)
            for k in range(size):
                order[k].first, order[k].second = group[end[w] + k], end[w] + k
            sort(order.begin(), order.end())
            for k in range(size):
                one = order[k].second
                memcpy(&sorted_rows[6 * k], &row[one, 0], 6 * sizeof(double))
                sorted_residuals[k], sorted_weights[k] = residual[one], weight[one]
            first = 0
            while first < size:
                last = first + 1
                while last < size and order[last].first == order[first].first:
                    last += 1
                names.push_back(order[first].first)
                sums.resize(42 * names.size(), 0.0)
                add(first, last, sorted_rows.data(), sorted_residuals.data(),
                    sorted_weights.data(), width, &sums[42 * names.size() - 42],
                    &sums[42 * names.size() - 6])
                first = last
            bound[w + 1] = names.size()
    found = np.empty(names.size(), dtype=np.intp), np.empty((names.size(), 42))
    cdef Py_ssize_t[::1] name = found[0]
    cdef double[:, ::1] sum_ = found[1]
    if names.size():
        memcpy(&name[0], names.data(), names.size() * sizeof(Py_ssize_t))
        memcpy(&sum_[0, 0], sums.data(), sums.size() * sizeof(double))
    return GroupSums(
        bounds, found[0], found[1][:, :36].reshape(-1, 6, 6), found[1][:, 36:].copy()
    )
