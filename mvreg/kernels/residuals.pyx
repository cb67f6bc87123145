# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Point-to-surface residuals of samples on patches, and how they change with the motions."""

from libc.math cimport sqrt
from libc.string cimport memcpy
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport Motion, cross, move, of_array, turn
from mvreg.kernels.patches cimport Patch, Patches, between, height_of_cell, one_of, placed

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks

# What rows are asked about, and in which unit (its inverse).
cdef struct About:
    double centre[3]
    double unit
    bint flat


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
    cdef Py_ssize_t count = len(surfaces), size = residuals.shape[0], w, k, wrong = -1
    cdef vector[double] motion = placed(motions, count)
    cdef const Py_ssize_t[:, ::1] way = checks.indices("ways", ways, count, "W", 2)
    cdef const Py_ssize_t[::1] end = checks.ends("ends", ends, size)
    cdef const Py_ssize_t[::1] here = checks.integers("samples", samples, "M")
    cdef const Py_ssize_t[::1] there = checks.integers("patches", patches, "M")
    cdef const double[::1] middle = checks.floats("centre", centre, 3)
    cdef Patches source, target
    cdef About about
    if end.shape[0] != way.shape[0] + 1:
        raise InputError(f"expected the ends of {way.shape[0]} ways, got {end.shape[0]} numbers")
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
            for k in range(end[w], end[w + 1]):
                if not (0 <= here[k] < source.size and 0 <= there[k] < target.size):
                    wrong = k
                    break
            else:
                fill(source, target, &motion[12 * way[w, 0]], &motion[12 * way[w, 1]],
                     end[w + 1] - end[w], &here[end[w]], &there[end[w]], &about,
                     &residuals[end[w]], &jacobian[end[w], 0], &points[end[w], 0], &aside[end[w]])
        if wrong >= 0:
            raise ValueError(
                f"expected positions among {source.size} samples and {target.size} patches, "
                f"got {here[wrong]} and {there[wrong]}")


cdef void fill(
    Patches source, Patches target, const double* from_source, const double* from_target,
    Py_ssize_t size, const Py_ssize_t* samples, const Py_ssize_t* patches, const About* about,
    double* residuals, double* jacobian, double* points, double* aside
) noexcept nogil:
    """The rows of one surface on another.

    Point to plane, with the plane that touches the surface below the point (Chen and Medioni 1992):
    ``r = h / R``, and for a small turn and shift of the source ``J = [p x n, n]``, with n the
    surface's normal and ``p = (x - centre) / R``.
    """
    cdef Motion into
    cdef double x[3]
    cdef double inward[3]
    cdef const Patch* patch
    cdef const Patch* cell
    cdef double* p
    cdef double* n
    cdef Py_ssize_t k
    cdef int m
    between(from_source, from_target, into)
    for k in range(size):
        patch = &target.patch[patches[k]]
        cell = &source.patch[samples[k]]
        move(into, cell.mean, x)
        residuals[k] = about.unit * height_of_cell(
            patch, x, cell.second, into, about.flat, inward, &aside[k])
        aside[k] /= patch.reach * patch.reach if patch.reach > 0 else 1.0
        n, p = jacobian + (6 * k + 3), points + 3 * k
        turn(from_target, inward, n)
        move(from_target, x, p)
        for m in range(3):
            p[m] = (p[m] - about.centre[m]) * about.unit
        cross(p, n, n - 3)


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
