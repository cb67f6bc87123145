# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Contacts summed up: to the normal equations of each way, and to what is known at each sample.

No row of the equations is kept: a contact is two positions, whatever is summed of it.
"""

from libc.string cimport memcpy, memset
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport Motion, cross, move, turn
from mvreg.kernels.patches cimport Patch, Patches, between, height_of_cell, one_of, placed

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks
from mvreg.kernels.results import NormalEquations

# What residuals are asked about, in which unit (its inverse), and beyond what they have no weight.
cdef struct About:
    double centre[3]
    double unit
    double width
    bint flat

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
    check_ends(end.shape[0], way.shape[0], first.shape[0], count)
    normals, gradients = np.zeros((way.shape[0], 6, 6)), np.zeros((way.shape[0], 6))
    cdef double[:, :, ::1] normal = normals
    cdef double[:, ::1] gradient = gradients
    about.unit, about.flat, about.width = 1 / radius, flat, width
    memcpy(about.centre, &middle[0], 3 * sizeof(double))
    for w in range(way.shape[0]):
        source, target = one_of(surfaces, way[w, 0]), one_of(surfaces, way[w, 1])
        one.size = end[w + 1] - end[w]
        if one.size == 0:
            continue
        one.samples, one.patches = &here[end[w]], &there[end[w]]
        check_inside(&one, source.size, target.size)
        check_room(first, way[w, 0], source.size)
        check_room(first, way[w, 1], target.size)
        one.cells, one.fits = &cell[first[way[w, 0]], 0], &fit[first[way[w, 1]], 0]
        with nogil:
            add(source, target, &motion[12 * way[w, 0]], &motion[12 * way[w, 1]], &one, &about,
                &normal[w, 0, 0], &gradient[w, 0])
    return NormalEquations(normals, gradients)


cdef int check_ends(Py_ssize_t ends, Py_ssize_t ways, Py_ssize_t begins, Py_ssize_t count) except -1:
    if ends != ways + 1:
        raise InputError(f"expected the ends of {ways} ways, got {ends} numbers")
    if begins != count + 1:
        raise InputError(f"expected where {count} surfaces begin and end, got {begins} numbers")
    return 0


cdef int check_inside(const Way* way, Py_ssize_t source, Py_ssize_t target) except -1:
    cdef Py_ssize_t k
    for k in range(way.size):
        if not (0 <= way.samples[k] < source and 0 <= way.patches[k] < target):
            raise ValueError(f"expected positions among {source} samples and {target} patches, "
                             f"got {way.samples[k]} and {way.patches[k]}")
    return 0


cdef int check_room(const Py_ssize_t[::1] begin, Py_ssize_t k, Py_ssize_t size) except -1:
    if begin[k + 1] - begin[k] != size:
        raise ValueError(
            f"begin: expected room for {size} samples of surface {k}, got {begin[k + 1] - begin[k]}")
    return 0


cdef void add(
    Patches source, Patches target, const double* from_source, const double* from_target,
    const Way* way, const About* about, double* normal, double* gradient
) noexcept nogil:
    """Add the contacts of one way to sums that are zero."""
    cdef Motion into
    cdef double x[3]
    cdef double p[3]
    cdef double inward[3]
    cdef double row[6]
    cdef double sums[36]
    cdef double slopes[6]
    cdef double aside, residual, square, slope, narrow = 1 / (about.width * about.width)
    cdef const Patch* patch
    cdef const Patch* cell
    cdef const double* known
    cdef const double* fit
    cdef Py_ssize_t k
    cdef int m, n
    between(from_source, from_target, into)
    memset(sums, 0, sizeof(sums))
    memset(slopes, 0, sizeof(slopes))
    for k in range(way.size):
        cell, patch = &source.patch[way.samples[k]], &target.patch[way.patches[k]]
        known, fit = way.cells + 2 * way.samples[k], way.fits + 3 * way.patches[k]
        move(into, cell.mean, x)
        residual = height_of_cell(patch, x, cell.second, into, about.flat, inward, &aside)
        aside /= patch.reach * patch.reach if patch.reach > 0 else 1.0
        square = residual * residual * narrow / (
            (4 - aside * (8 - 18 * aside)) * fit[1] + known[1] + fit[2])
        if not square < 1:
            continue
        turn(from_target, inward, row + 3)
        move(from_target, x, p)
        for m in range(3):
            p[m] = (p[m] - about.centre[m]) * about.unit
        cross(p, row + 3, row)
        square = known[0] * fit[0] * ((1 - square) * (1 - square))
        residual *= about.unit
        for m in range(6):
            slope = square * row[m]
            slopes[m] += slope * residual
            for n in range(m + 1):
                sums[6 * m + n] += slope * row[n]
    for m in range(6):
        gradient[m] = slopes[m]
        for n in range(m + 1):
            normal[6 * m + n] = normal[6 * n + m] = sums[6 * m + n]


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
    cdef Way one
    check_ends(end.shape[0], way.shape[0], 1, 0)
    totals = np.array(known[:, 0])
    cdef double[::1] total = totals
    for w in range(way.shape[0]):
        source, target = first[way[w, 0]], first[way[w, 1]]
        one.size = end[w + 1] - end[w]
        if one.size == 0:
            continue
        one.samples, one.patches = &here[end[w]], &there[end[w]]
        check_inside(&one, first[way[w, 0] + 1] - source, first[way[w, 1] + 1] - target)
        with nogil:
            for k in range(one.size):
                total[source + one.samples[k]] += known[target + one.patches[k], 1]
    return totals
