# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Contacts summed up: to the normal equations of each way, and to what is known at each sample.

No row of the equations is kept: a contact is two positions, whatever is summed of it.
"""

from libc.string cimport memcpy
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport Motion
from mvreg.kernels.normal_equations cimport Sums, add_row, clear, write
from mvreg.kernels.patches cimport (
    Patch, Patches, between, check_ends, check_inside, one_of, placed,
)
from mvreg.kernels.residuals cimport About, gap_of, row_of

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks
from mvreg.kernels.results import NormalEquations

# Of one way: its contacts; the weight and the variance of each of the source's samples, and of the
# target's patches the weight and two variances.
cdef struct Way:
    Py_ssize_t size
    const int* samples
    const int* patches
    const double* cells
    const double* fits


def normal_equations(
    surfaces, motions, ways, ends, samples, patches, begin, cells, fits, centre, double radius,
    bint flat, double width
):
    """The weighted sums ``J^T W J`` and ``J^T W r`` over each way's contacts.

    What `mvreg.kernels.residuals.rows` makes, with r and J in units of the radius, summed up. A
    contact weighs as much as its sample times as much as its patch, and ``(1 - u^2)^2`` of that for
    a residual u below 1 in units of the width (Tukey's biweight, Beaton and Tukey 1974).

    Parameters
    ----------
    surfaces, motions, ways, centre, radius, flat
        As in `mvreg.kernels.residuals.rows`.
    ends : (W + 1,) array
    samples, patches : (M,) arrays
        As `mvreg.kernels.contacts` gives them.
    begin : (N + 1,) array
        Where the samples of each surface begin in the next two, and where those of the last one
        end.
    cells : (T, 2) array
        Of each sample its weight, and the variance of its cell's mean (length^2).
    fits : (T, 3) array
        Of each patch its weight, the variance of one of its points over their number, and that of
        what it does not follow (length^2): ``(4 - 8 t + 18 t^2)`` times the first, for a squared
        distance t along the patch in units of its reach, plus the second is that of its height.
    width : float
        Of the kernel, in standard deviations of the residuals.

    Returns
    -------
    NormalEquations
    """
    cdef Py_ssize_t count = len(surfaces), w
    cdef vector[double] motion = placed(motions, count)
    cdef const Py_ssize_t[:, ::1] way = checks.indices("ways", ways, count, "W", 2)
    cdef const int[::1] here = checks.places("samples", samples, "M")
    cdef Py_ssize_t size = here.shape[0]
    cdef const int[::1] there = checks.places("patches", patches, size)
    cdef const Py_ssize_t[::1] end = checks.ends("ends", ends, size)
    cdef const double[:, ::1] cell = checks.floats("cells", cells, "T", 2)
    cdef const double[:, ::1] fit = checks.floats("fits", fits, cell.shape[0], 3)
    cdef const Py_ssize_t[::1] first = checks.ends("begin", begin, cell.shape[0])
    cdef const double[::1] middle = checks.floats("centre", centre, 3)
    cdef Patches source, target
    cdef About about
    cdef Way one
    checks.positive(radius=radius)
    check_ends(end.shape[0], way.shape[0])
    if first.shape[0] != count + 1:
        raise InputError(
            f"expected where {count} surfaces begin and end, got {first.shape[0]} numbers")
    normals, gradients = np.zeros((way.shape[0], 6, 6)), np.zeros((way.shape[0], 6))
    cdef double[:, :, ::1] normal = normals
    cdef double[:, ::1] gradient = gradients
    about.unit, about.flat = 1 / radius, flat
    memcpy(about.centre, &middle[0], 3 * sizeof(double))
    for w in range(way.shape[0]):
        source, target = one_of(surfaces, way[w, 0]), one_of(surfaces, way[w, 1])
        one.size = end[w + 1] - end[w]
        if one.size == 0:
            continue
        one.samples, one.patches = &here[end[w]], &there[end[w]]
        check_inside(one.samples, one.patches, one.size, source.size, target.size)
        check_room(first, way[w, 0], source.size)
        check_room(first, way[w, 1], target.size)
        one.cells, one.fits = &cell[first[way[w, 0]], 0], &fit[first[way[w, 1]], 0]
        with nogil:
            add(source, target, &motion[12 * way[w, 0]], &motion[12 * way[w, 1]], &one, &about,
                width, &normal[w, 0, 0], &gradient[w, 0])
    return NormalEquations(normals, gradients)


cdef int check_room(const Py_ssize_t[::1] begin, Py_ssize_t k, Py_ssize_t size) except -1:
    if begin[k + 1] - begin[k] != size:
        raise ValueError(
            f"begin: expected room for {size} samples of surface {k}, got {begin[k + 1] - begin[k]}")
    return 0


cdef void add(
    Patches source, Patches target, const double* from_source, const double* from_target,
    const Way* way, const About* about, double width, double* normal, double* gradient
) noexcept nogil:
    """The sums over the contacts of one way."""
    cdef Motion into
    cdef double x[3]
    cdef double p[3]
    cdef double inward[3]
    cdef double row[6]
    cdef Sums sums
    cdef double aside, residual, square, narrow = 1 / (width * width)
    cdef const Patch* patch
    cdef const Patch* cell
    cdef const double* known
    cdef const double* fit
    cdef Py_ssize_t k
    between(from_source, from_target, into)
    clear(&sums)
    for k in range(way.size):
        cell, patch = &source.patch[way.samples[k]], &target.patch[way.patches[k]]
        known, fit = way.cells + 2 * way.samples[k], way.fits + 3 * way.patches[k]
        residual = gap_of(cell, patch, into, about.flat, x, inward, &aside)
        square = residual * residual * narrow / (
            (4 - aside * (8 - 18 * aside)) * fit[1] + known[1] + fit[2])
        if not square < 1:
            continue
        row_of(from_target, x, inward, about, p, row)
        add_row(&sums, row, known[0] * fit[0] * ((1 - square) * (1 - square)),
                residual * about.unit)
    write(&sums, normal, gradient)


def known_at(ways, ends, samples, patches, begin, precisions):
    """What all the patches know that a sample lies on, its own share included.

    Parameters
    ----------
    ways, ends, samples, patches, begin
        As above.
    precisions : (T, 2) array
        Of each sample, and of each patch.

    Returns
    -------
    (T,) array
    """
    cdef const double[:, ::1] known = checks.floats("precisions", precisions, "T", 2)
    cdef const Py_ssize_t[::1] first = checks.ends("begin", begin, known.shape[0])
    cdef const Py_ssize_t[:, ::1] way = checks.indices("ways", ways, first.shape[0] - 1, "W", 2)
    cdef const int[::1] here = checks.places("samples", samples, "M")
    cdef Py_ssize_t size = here.shape[0], w, k, source, target
    cdef const int[::1] there = checks.places("patches", patches, size)
    cdef const Py_ssize_t[::1] end = checks.ends("ends", ends, size)
    check_ends(end.shape[0], way.shape[0])
    totals = np.array(known[:, 0])
    cdef double[::1] total = totals
    for w in range(way.shape[0]):
        source, target = first[way[w, 0]], first[way[w, 1]]
        if end[w] == end[w + 1]:
            continue
        with nogil:
            check_inside(&here[end[w]], &there[end[w]], end[w + 1] - end[w],
                         first[way[w, 0] + 1] - source, first[way[w, 1] + 1] - target)
            for k in range(end[w], end[w + 1]):
                total[source + here[k]] += known[target + there[k], 1]
    return totals
