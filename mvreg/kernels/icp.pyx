# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Iterative closest points, trimmed: to points or to tangent planes."""

from libc.math cimport INFINITY, pow, sqrt

from mvreg.kernels.anderson cimport Acceleration
from mvreg.kernels.linear cimport (
    Motion, compose, copy, exponential, of_array, solve, squared_gap, to_array,
)
from mvreg.kernels.tree cimport Tree
from mvreg.kernels.trimmed_pairs cimport Pairing, check_paired

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks
from mvreg.kernels.results import Registration

# Levenberg's damping, and how many iterations without gain end a search: mvreg.stages.refine.
cdef double DAMPING = 1e-3
cdef int PATIENCE = 3


def trimmed_icp(
    Tree tree not None, points, transform, double bound, double least, double min_overlap, double power,
    int max_iterations, double tolerance, bint helped=False
):
    """Trimmed ICP: pairs, overlap and motion in turn, each solved exactly, Eqs. (3) to (5).

    Parameters
    ----------
    tree : Tree
        Of the target's points.
    points : (N, 3) array
        The source's.
    transform : (4, 4) array
        ``T_target_source`` to start from.
    bound, least : float
        How far neighbours are looked for at first, and at least (length).
    min_overlap, power : float
        As in `mvreg.kernels.trimmed_pairs.trimmed`.
    max_iterations : int
    tolerance : float
        It ends when psi shrinks by no more than this share of itself.
    helped : bool
        Whether a second thread may help, if there are many points. The answer is the same.

    Returns
    -------
    Registration
    """
    cdef Pairing pairing = Pairing(tree, points, bound, min_overlap, power)
    cdef Acceleration ahead = Acceleration(pairing)
    cdef Motion motion, plain
    cdef double previous = INFINITY
    cdef int iteration = 0
    cdef bint still = False, bold = False, paired = True
    of_array(checks.transform("transform", transform, finite=True), motion)
    checks.positive(least=least)
    if max_iterations < 0:
        raise InputError(f"max_iterations: expected 0 or more, got {max_iterations}")
    if helped:
        pairing.ask_for_help()
    copy(motion, plain)
    with nogil:
        while True:
            paired = pairing.pair(motion)
            if bold and not pairing.objective < previous:  # too far ahead: as if it had not been
                copy(plain, motion)
                ahead.forget()
                paired = pairing.pair(motion)
            if not paired:
                break
            still = previous - pairing.objective <= tolerance * pairing.objective
            if still or iteration == max_iterations:
                break
            previous = pairing.objective
            pairing.narrow(least)
            pairing.fit(plain)
            bold = ahead.leap(motion, plain)
            iteration += 1
    check_paired(paired)
    return Registration(as_array(motion), pairing.answer(), iteration, bool(still))


cdef double plane_psi(Pairing pairing, const double[:, ::1] normals, double exponent) noexcept nogil:
    """Mean squared distance from the tangent planes over the overlap to a power (length^2)."""
    cdef double total = 0, height
    cdef Py_ssize_t i, k, j
    for i in range(pairing.kept):
        k = pairing.order[i]
        j = pairing.partner[k]
        height = ((pairing.moved[3 * k] - pairing.target[j, 0]) * normals[j, 0]
                  + (pairing.moved[3 * k + 1] - pairing.target[j, 1]) * normals[j, 1]
                  + (pairing.moved[3 * k + 2] - pairing.target[j, 2]) * normals[j, 2])
        total += height * height
    return total / pairing.kept / pow(<double> pairing.kept / pairing.size, 1 + exponent)


cdef void plane_step(
    Pairing pairing, const double[:, ::1] normals, double longest, double* motion
) noexcept nogil:
    """The damped Gauss-Newton step that brings the pairs kept onto the tangent planes."""
    cdef double centre[3]
    cdef double p[3]
    cdef double row[6]
    cdef double a[36]
    cdef double g[6]
    cdef Motion small = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]
    cdef double radius = 0, height, trace = 0, length = 0
    cdef Py_ssize_t i, k, j
    cdef int m, n
    for m in range(3):
        centre[m] = 0
    for i in range(pairing.kept):
        k = pairing.order[i]
        for m in range(3):
            centre[m] += pairing.moved[3 * k + m]
    for m in range(3):
        centre[m] /= pairing.kept
    for i in range(pairing.kept):
        radius += squared_gap(&pairing.moved[3 * pairing.order[i]], centre)
    radius = sqrt(radius / pairing.kept)
    if radius == 0:
        radius = 1
    for m in range(36):
        a[m] = 0
    for m in range(6):
        g[m] = 0
    for i in range(pairing.kept):
        k = pairing.order[i]
        j = pairing.partner[k]
        height = 0
        for m in range(3):
            p[m] = (pairing.moved[3 * k + m] - centre[m]) / radius
            row[3 + m] = normals[j, m]
            height += (pairing.moved[3 * k + m] - pairing.target[j, m]) * normals[j, m]
        row[0] = p[1] * row[5] - p[2] * row[4]
        row[1] = p[2] * row[3] - p[0] * row[5]
        row[2] = p[0] * row[4] - p[1] * row[3]
        for m in range(6):
            g[m] -= row[m] * height
            for n in range(m + 1):
                a[6 * m + n] += row[m] * row[n]
    for m in range(6):
        trace += a[7 * m]
    for m in range(12):
        motion[m] = 1.0 if m in (0, 4, 8) else 0.0
    if trace == 0:
        return
    for m in range(6):
        a[7 * m] += DAMPING * trace / 6
    if not solve(a, g, 6):
        return
    for m in range(6):
        length += g[m] * g[m]
    length = sqrt(length)
    if length > longest:
        for m in range(6):
            g[m] *= longest / length
    for m in range(3):
        g[m] /= radius
    exponential(g, small)
    for m in range(9):
        motion[m] = small[m]
    for m in range(3):  # about the centre
        motion[9 + m] = centre[m] + small[9 + m] - (
            small[3 * m] * centre[0] + small[3 * m + 1] * centre[1] + small[3 * m + 2] * centre[2])


def plane_icp(
    Tree tree not None, normals, points, transform, double bound, double least, double min_overlap,
    double exponent, int max_iterations, double tolerance, double longest, bint helped=False
):
    """Point-to-plane ICP, trimmed as `trimmed_icp` is; the best pose of all is the answer.

    Parameters
    ----------
    tree, points, transform, bound, least, min_overlap, max_iterations, helped
        As in `trimmed_icp`; pairs are trimmed with a power of ``1 + exponent``.
    normals : (T, 3) array
        The target's, unit.
    exponent : float
        ``psi = mean squared distance from the planes / overlap ** (1 + exponent)`` (length^2).
    tolerance : float
        It ends when psi shrinks by no more than this share of itself three times in a row.
    longest : float
        A step moves points by no more than this (length), as a root mean square.

    Returns
    -------
    Registration
        Its psi is that of the planes.
    """
    cdef Pairing pairing = Pairing(tree, points, bound, min_overlap, 1 + exponent)
    cdef const double[:, ::1] planes = checks.floats("normals", normals, tree.n, 3)
    cdef Motion motion, best, step, following
    cdef double psi, least_psi = INFINITY
    cdef int iteration = 0, waited = 0
    cdef bint paired
    of_array(checks.transform("transform", transform, finite=True), motion)
    checks.positive(least=least)
    if helped:
        pairing.ask_for_help()
    with nogil:
        paired = pairing.pair(motion)
        if paired:
            least_psi = plane_psi(pairing, planes, exponent)
    check_paired(paired)
    copy(motion, best)
    pairs = pairing.answer()
    while iteration < max_iterations and waited < PATIENCE:
        with nogil:
            iteration += 1
            pairing.narrow(least)
            plane_step(pairing, planes, longest, step)
            compose(step, motion, following)
            copy(following, motion)
            paired = pairing.pair(motion)
            psi = plane_psi(pairing, planes, exponent) if paired else INFINITY
        check_paired(paired)
        waited = 0 if psi < (1 - tolerance) * least_psi else waited + 1
        if psi < least_psi:
            least_psi = psi
            copy(motion, best)
            pairs = pairing.answer()
    return Registration(
        as_array(best), pairs._replace(psi=least_psi), iteration, waited == PATIENCE)


cdef as_array(const double* motion):
    transform = np.eye(4)
    to_array(motion, transform)
    return transform
