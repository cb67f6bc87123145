# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Point-to-surface residuals of samples on patches, and how they change with the motions."""

from libc.math cimport sqrt
from libc.string cimport memcpy
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport Motion, move, of_array
from mvreg.kernels.patches cimport Patches, between, check_ends, check_inside, one_of, placed

import numpy as np

from mvreg.kernels import checks


def rows(
    surfaces, motions, ways, ends, samples, patches, centre, double radius, bint flat,
    double[::1] residuals not None, double[:, ::1] jacobian not None,
    double[:, ::1] points not None, double[::1] aside not None
):
    """How far samples' cells are from patches, and how that changes with the source's motion.

    Parameters
    ----------
    surfaces, motions, ways, ends, samples, patches
        As `mvreg.kernels.contacts` takes and gives them; ways and ends may be those of some ways only.
    centre : (3,) array
    radius : float
        Answers are about this point of the common frame, in units of this length.
    flat : bool
        Ask the tangent planes instead.
    residuals : (M,) array
        Filled where the ways have contacts.
    jacobian : (M, 6) array
        So is this. Of the residuals: for a turn about the centre, and a shift in units of the
        radius.
    points : (M, 3) array
        And this: where the samples are.
    aside : (M,) array
        And this: how far along the patches they are, in units of how far these reach, squared.
    """
    cdef Py_ssize_t count = len(surfaces), size = residuals.shape[0], w
    cdef vector[double] motion = placed(motions, count)
    cdef const Py_ssize_t[:, ::1] way = checks.indices("ways", ways, count, "W", 2)
    cdef const Py_ssize_t[::1] end = checks.ends("ends", ends, size)
    cdef const int[::1] here = checks.places("samples", samples, "M")
    cdef const int[::1] there = checks.places("patches", patches, "M")
    cdef const double[::1] middle = checks.floats("centre", centre, 3)
    cdef Patches source, target
    cdef About about
    check_ends(end.shape[0], way.shape[0])
    if not (here.shape[0] == there.shape[0] == jacobian.shape[0] == points.shape[0]
            == aside.shape[0] == size):
        raise ValueError(f"expected {size} samples, patches and rows, got {here.shape[0]}, "
                         f"{there.shape[0]}, {jacobian.shape[0]} and {points.shape[0]}")
    if jacobian.shape[1] != 6 or points.shape[1] != 3:
        raise ValueError("expected rows of 6 and points of 3 numbers")
    about.unit, about.flat = 1 / radius, flat
    memcpy(about.centre, &middle[0], 3 * sizeof(double))
    for w in range(way.shape[0]):
        source, target = one_of(surfaces, way[w, 0]), one_of(surfaces, way[w, 1])
        if end[w] == end[w + 1]:
            continue
        with nogil:
            check_inside(&here[end[w]], &there[end[w]], end[w + 1] - end[w], source.size,
                         target.size)
            fill(source, target, &motion[12 * way[w, 0]], &motion[12 * way[w, 1]],
                 end[w + 1] - end[w], &here[end[w]], &there[end[w]], &about,
                 &residuals[end[w]], &jacobian[end[w], 0], &points[end[w], 0], &aside[end[w]])


cdef void fill(
    Patches source, Patches target, const double* from_source, const double* from_target,
    Py_ssize_t size, const int* samples, const int* patches, const About* about,
    double* residuals, double* jacobian, double* points, double* aside
) noexcept nogil:
    """The rows of one surface on another."""
    cdef Motion into
    cdef double x[3]
    cdef double inward[3]
    cdef Py_ssize_t k
    between(from_source, from_target, into)
    for k in range(size):
        residuals[k] = about.unit * gap_of(
            &source.patch[samples[k]], &target.patch[patches[k]], into, about.flat, x, inward,
            &aside[k])
        row_of(from_target, x, inward, about, points + 3 * k, jacobian + 6 * k)


def farthest(points, before, after):
    """How far a motion goes from another for any of points (N, 3), at most; 0 for no points."""
    cdef const double[:, ::1] given = checks.floats("points", points, "N", 3)
    cdef Motion change
    cdef double x[3]
    cdef double most = 0, squared
    cdef Py_ssize_t k
    of_array(checks.transform("after", after) - checks.transform("before", before), change)
    with nogil:
        for k in range(given.shape[0]):
            move(change, &given[k, 0], x)
            squared = x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
            most = squared if squared > most else most
    return sqrt(most)
