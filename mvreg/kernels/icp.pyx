# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Closest points, trimmed exactly, and the motions that follow from them, again and again.

A search that comes to rest asks for the same neighbours many times. Each point remembers where it
was when it was last looked up, and how far all other points of the tree were from there: as long
as it has moved less than that allows its neighbour is the same, and costs one distance.
"""

from libc.math cimport INFINITY, ceil, fmax, fmin, pow, sqrt
from libc.stdint cimport uint64_t
from libc.string cimport memcpy, memset
from libcpp.algorithm cimport sort
from libcpp.utility cimport pair
from libcpp.vector cimport vector

from mvreg.kernels.helper cimport Helper
from mvreg.kernels.linear cimport (
    Motion, compose, exponential, kabsch, move, of_array, solve, squared_gap, to_array, turn_of,
)
from mvreg.kernels.tree cimport Tree

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks

cdef double ROUNDING = 1 - 1e-12
# Levenberg's damping, and how many iterations without gain end a search: mvreg.stages.plane_icp.
cdef double DAMPING = 1e-3
cdef int PATIENCE = 3
# Poses that the acceleration remembers (5 in the authors' code), and what keeps it solvable.
cdef enum:
    MEMORY = 6
cdef double NARROW = 1.25
# Squared lengths that are not quite zero.
cdef double LEAST = 1e-300
cdef double REGULAR = 1e-9
# Of the bits of a distance, from the top; and points that are worth a second thread's while.
cdef enum:
    BYTES = 4
    MANY = 1500

# The bits of a distance, and whose it is.
ctypedef pair[uint64_t, Py_ssize_t] Ranked


cdef class Pairing:
    """The closest points of a cloud that moves over a tree, trimmed to the least psi, Eq. (4)."""

    cdef Tree tree
    cdef const double[:, ::1] points
    cdef const double[:, ::1] target
    cdef Py_ssize_t size, first, kept
    cdef double bound, objective, fine
    cdef vector[double] moved, asked, others, distance, weight
    cdef vector[Py_ssize_t] partner, order
    cdef vector[Ranked] ranked, spare
    cdef Helper* helper

    def __cinit__(self, *_):
        self.helper = NULL

    def __dealloc__(self):
        del self.helper

    def __init__(self, Tree tree not None, points, double bound, double min_overlap, double power):
        cdef Py_ssize_t i
        self.tree = tree
        self.target = tree.cloud
        self.fine = tree.grain / 4
        self.points = checks.floats("points", points, "N", 3, finite=True)
        self.size = self.points.shape[0]
        if not self.size or not tree.n:
            raise InputError(f"expected one or more points on either side, got {self.size} and "
                             f"{tree.n} in the tree")
        if not bound > 0:  # it may be infinite
            raise InputError(f"bound: expected a positive number, got {bound}")
        if not 0 <= min_overlap <= 1:
            raise InputError(f"min_overlap: expected a share in [0, 1], got {min_overlap}")
        self.bound = bound
        self.first = <Py_ssize_t> fmax(ceil(min_overlap * self.size), 1) - 1
        self.moved.resize(3 * self.size)
        self.asked.resize(3 * self.size)
        self.others.resize(self.size, -INFINITY)
        self.distance.resize(self.size)
        self.partner.resize(self.size, -1)
        self.weight.resize(self.size)
        self.order.resize(self.size)
        self.ranked.resize(self.size)
        self.spare.resize(self.size)
        for i in range(self.size):
            self.weight[i] = pow(<double> self.size / <double> (i + 1), power) / (i + 1)

    cdef bint pair(self, const double* motion) noexcept nogil:
        """Pair and trim under a motion; a bound too narrow for the best prefix is widened.

        Returns False, and psi is infinite, where that cannot end: squared distances overflow.
        """
        cdef Py_ssize_t i, found
        for i in range(self.size):
            move(motion, &self.points[i, 0], &self.moved[3 * i])
        while True:
            if self.helper:
                self.helper.both_halves()
            else:
                self.look_between(0, self.size)
            found = 0
            for i in range(self.size):
                found += self.distance[i] < INFINITY
            self.rank()
            self.trim()
            if self.kept <= found or found == self.size:
                return True
            if not self.bound < INFINITY:
                self.objective = INFINITY
                return False
            self.bound *= 2

    cdef void ask_for_help(self):
        """Let a second thread look at half of the points, if they are worth its while."""
        if self.size >= MANY:
            self.helper = new Helper(<void*> look_at_half, <void*> self)

    cdef void look_between(self, Py_ssize_t start, Py_ssize_t stop) noexcept nogil:
        cdef Py_ssize_t i
        for i in range(start, stop):
            self.look(i)

    cdef void look(self, Py_ssize_t i) noexcept nogil:
        """Find the neighbour of one point within the bound, or remember it."""
        cdef double* x = &self.moved[3 * i]
        cdef Py_ssize_t partner = self.partner[i]
        cdef double gone = sqrt(squared_gap(x, &self.asked[3 * i]))
        cdef double least = (self.others[i] - gone) * ROUNDING
        cdef double d = INFINITY, squared, second, reach = self.bound
        if partner >= 0:
            d = sqrt(squared_gap(x, &self.target[partner, 0]))
        if d < least or (partner < 0 and self.bound <= least):
            self.distance[i] = d if d < self.bound else INFINITY
            return
        self.asked[3 * i], self.asked[3 * i + 1], self.asked[3 * i + 2] = x[0], x[1], x[2]
        # The old partner must be found again, also where it is not alone, or at no distance.
        reach = fmin(reach, d * (1 + 1e-9))
        if gone > self.fine:  # it will not hold for the next step, either: ask for less
            squared = fmax(reach * reach, LEAST)
            partner = self.tree.find(x, &squared)
            self.others[i] = -INFINITY if partner >= 0 else reach
        else:  # far enough that the answer holds for a while
            reach += fmax(4 * gone, self.fine)
            second = fmax(reach * reach, LEAST)
            partner = self.tree.find_two(x, &squared, &second)
            self.others[i] = sqrt(second)
        d = sqrt(squared) if partner >= 0 else INFINITY
        self.partner[i] = partner
        self.distance[i] = d if d < self.bound else INFINITY

    cdef void rank(self) noexcept nogil:
        """Sort by distance, the lower index first: by the upper half of its bits, byte by byte.

        Distances are not negative: their bits ascend as they do. What that leaves out of order is
        next to its place, unless many are all but equal.
        """
        cdef Py_ssize_t counts[BYTES][256]
        cdef Py_ssize_t i, j, place, before, steps = 0, most = 8 * self.size
        cdef uint64_t bits
        cdef Ranked one
        cdef int byte, value
        memset(counts, 0, sizeof(counts))
        for i in range(self.size):
            memcpy(&bits, &self.distance[i], sizeof(bits))
            self.ranked[i].first, self.ranked[i].second = bits, i
            for byte in range(BYTES):
                counts[byte][(bits >> (32 + 8 * byte)) & 255] += 1
        for byte in range(BYTES):
            place = 0
            for value in range(256):
                before = counts[byte][value]
                counts[byte][value] = place
                place += before
            for i in range(self.size):
                value = (self.ranked[i].first >> (32 + 8 * byte)) & 255
                self.spare[counts[byte][value]] = self.ranked[i]
                counts[byte][value] += 1
            self.ranked.swap(self.spare)
        for i in range(self.size):
            one = self.ranked[i]
            j = i
            while j > 0 and steps < most and one.first < self.ranked[j - 1].first:
                self.ranked[j] = self.ranked[j - 1]
                j -= 1
                steps += 1
            self.ranked[j] = one
        if steps >= most:
            sort(self.ranked.begin(), self.ranked.end())
        for i in range(self.size):
            self.order[i] = self.ranked[i].second

    cdef void trim(self) noexcept nogil:
        """The prefix of the sorted distances with the least psi."""
        cdef double total = 0, d, psi
        cdef Py_ssize_t i
        self.objective = INFINITY
        self.kept = self.size
        for i in range(self.size):
            d = fmin(self.distance[self.order[i]], self.bound)
            total += d * d
            psi = total * self.weight[i]  # Eq. (3), (4)
            if i >= self.first and psi < self.objective:
                self.objective = psi
                self.kept = i + 1

    cdef double last(self) noexcept nogil:
        """How far the farthest pair kept is apart."""
        return fmin(self.distance[self.order[self.kept - 1]], self.bound)

    cdef void narrow(self, double least) noexcept nogil:
        """The bound of the next iteration: shrinks slowly, since widening asks all again."""
        self.bound = fmax(NARROW * self.last(), least)

    cdef void fit(self, double* motion) noexcept nogil:
        """The motion that brings the pairs kept together best, Eq. (5)."""
        cdef double h[9]
        cdef double here[3]
        cdef double there[3]
        cdef Py_ssize_t i, k
        cdef int a, b
        cdef const double* p
        cdef const double* q
        for a in range(9):
            h[a] = 0
        for a in range(3):
            here[a], there[a] = 0, 0
        for i in range(self.kept):
            k = self.order[i]
            for a in range(3):
                here[a] += self.points[k, a]
                there[a] += self.target[self.partner[k], a]
        for a in range(3):
            here[a] /= self.kept
            there[a] /= self.kept
        for i in range(self.kept):
            k = self.order[i]
            p, q = &self.points[k, 0], &self.target[self.partner[k], 0]
            for a in range(3):
                for b in range(3):
                    h[3 * a + b] += (p[a] - here[a]) * (q[b] - there[b])
        kabsch(h, here, there, motion)

    cdef answer(self):
        """What `trimmed` returns."""
        cdef Py_ssize_t i
        chosen, targets = np.empty(self.kept, dtype=np.intp), np.empty(self.kept, dtype=np.intp)
        distances = np.empty(self.kept)
        cdef Py_ssize_t[::1] source = chosen, target = targets
        cdef double[::1] far = distances
        for i in range(self.kept):
            source[i] = self.order[i]
            target[i] = self.partner[self.order[i]]
            far[i] = fmin(self.distance[self.order[i]], self.bound)
        return chosen, targets, distances, self.objective, self.bound


cdef void look_at_half(Pairing pairing, int half) noexcept nogil:
    """What a thread and its helper do of one look."""
    cdef Py_ssize_t middle = pairing.size // 2
    if half:
        pairing.look_between(middle, pairing.size)
    else:
        pairing.look_between(0, middle)


def trimmed(Tree tree not None, points, double bound, double min_overlap, double power):
    """The nearest neighbours of points (N, 3) in a tree, trimmed to the least psi, Eq. (4).

    ``psi = mean squared distance of those kept / overlap ** power``. A point without a neighbour
    within the bound is at least that far away: if the best prefix holds under that lower bound
    without such a point it holds for the true distances; else the bound is widened.

    Returns
    -------
    chosen, targets : (P,) arrays
        Positions of the points kept, nearest first, and of their neighbours in the tree.
    distances : (P,) array
    psi : float
    bound : float
        How far neighbours had to be looked for.
    """
    cdef Pairing pairing = Pairing(tree, points, bound, min_overlap, power)
    cdef Motion motion
    cdef bint paired
    of_array(np.eye(4), motion)
    with nogil:
        paired = pairing.pair(motion)
    check_paired(paired)
    return pairing.answer()


cdef int check_paired(bint paired) except -1:
    if not paired:
        raise InputError("expected points and a motion whose squared distances are finite, got "
                         "points so far apart that these overflow")
    return 0


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
        As in `trimmed`.
    max_iterations : int
    tolerance : float
        It ends when psi shrinks by no more than this share of itself.
    helped : bool
        Whether a second thread may help, if there are many points. The answer is the same.

    Returns
    -------
    transform : (4, 4) array
    pairs : tuple
        What `trimmed` returns for that pose.
    iterations : int
    converged : bool
    """
    cdef Pairing pairing = Pairing(tree, points, bound, min_overlap, power)
    cdef Acceleration ahead = Acceleration(pairing)
    cdef Motion motion, plain
    cdef double previous = INFINITY
    cdef int iteration = 0
    cdef bint still = False, bold = False, paired = True
    of_array(checks.transform("transform", transform), motion)
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
    return as_array(motion), pairing.answer(), iteration, bool(still)


cdef class Acceleration:
    """Anderson acceleration of a sequence of poses: a leap to where the last few steps lead.

    After Zhang, Yao and Deng, "Fast and robust iterative closest point", PAMI 2022: poses as
    twists, from the first one, of which the turn counts by the radius of the cloud.
    """

    cdef double at[MEMORY][6]
    cdef double to[MEMORY][6]
    cdef Motion base
    cdef double centre[3]
    cdef double radius
    cdef int held
    cdef Pairing pairing

    def __init__(self, pairing):
        self.pairing = pairing
        self.held = -1

    cdef void forget(self) noexcept nogil:
        self.held = min(self.held, 0)

    cdef void begin(self, const double* motion) noexcept nogil:
        """Twists are told from this pose, about the middle of the cloud."""
        cdef Py_ssize_t i
        cdef int m
        copy(motion, self.base)
        for m in range(3):
            self.centre[m] = 0
        for i in range(self.pairing.size):
            for m in range(3):
                self.centre[m] += self.pairing.moved[3 * i + m] / self.pairing.size
        self.radius = 0
        for i in range(self.pairing.size):
            self.radius += squared_gap(&self.pairing.moved[3 * i], self.centre)
        self.radius = sqrt(self.radius / self.pairing.size)
        if self.radius == 0:
            self.radius = 1
        self.held = 0

    cdef void coordinates(self, const double* motion, double* six) noexcept nogil:
        """The turn from the base, times the radius, and where the middle goes."""
        cdef double turn[9]
        cdef double inside[3]
        cdef int i, j
        for i in range(3):
            for j in range(3):
                turn[3 * i + j] = (motion[3 * i] * self.base[3 * j]
                                   + motion[3 * i + 1] * self.base[3 * j + 1]
                                   + motion[3 * i + 2] * self.base[3 * j + 2])
        turn_of(turn, six)
        for i in range(3):
            six[i] *= self.radius
            inside[i] = 0
            for j in range(3):
                inside[i] += turn[3 * i + j] * (self.centre[j] - self.base[9 + j])
            six[3 + i] = inside[i] + motion[9 + i] - self.centre[i]

    cdef void motion_at(self, const double* six, double* motion) noexcept nogil:
        """The pose of coordinates."""
        cdef double twist[6]
        cdef Motion turn
        cdef int i, j
        for i in range(3):
            twist[i] = six[i] / self.radius
            twist[3 + i] = 0
        exponential(twist, turn)
        for i in range(3):
            for j in range(3):
                motion[3 * i + j] = (turn[3 * i] * self.base[j] + turn[3 * i + 1] * self.base[3 + j]
                                     + turn[3 * i + 2] * self.base[6 + j])
            motion[9 + i] = six[3 + i] + self.centre[i]
            for j in range(3):
                motion[9 + i] += turn[3 * i + j] * (self.base[9 + j] - self.centre[j])

    cdef bint leap(self, double* motion, const double* plain) noexcept nogil:
        """From the pose that led to `plain` to the next one; whether it is another than that."""
        cdef double normal[MEMORY * MEMORY]
        cdef double share[MEMORY]
        cdef double apart[MEMORY][6]
        cdef double six[6]
        cdef double last[6]
        cdef double trace = 0
        cdef int newest, older, i, j, m
        if self.held < 0:
            self.begin(motion)
        if self.held == MEMORY:
            for i in range(MEMORY - 1):
                for m in range(6):
                    self.at[i][m], self.to[i][m] = self.at[i + 1][m], self.to[i + 1][m]
            self.held -= 1
        newest = self.held
        self.coordinates(motion, self.at[newest])
        self.coordinates(plain, self.to[newest])
        self.held += 1
        copy(plain, motion)
        if newest == 0:
            return False
        for m in range(6):
            last[m] = self.to[newest][m] - self.at[newest][m]
        for i in range(newest):
            for m in range(6):
                apart[i][m] = last[m] - (self.to[i][m] - self.at[i][m])
        for i in range(newest):
            share[i] = 0
            for m in range(6):
                share[i] += apart[i][m] * last[m]
            for j in range(newest):
                normal[newest * i + j] = 0
                for m in range(6):
                    normal[newest * i + j] += apart[i][m] * apart[j][m]
            trace += normal[(newest + 1) * i]
        for i in range(newest):
            normal[(newest + 1) * i] += REGULAR * trace
        if not solve(normal, share, newest):
            return False
        for m in range(6):
            six[m] = self.to[newest][m]
            for i in range(newest):
                six[m] -= share[i] * (self.to[newest][m] - self.to[i][m])
        self.motion_at(six, motion)
        return True


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
    As `trimmed_icp`; psi is that of the planes.
    """
    cdef Pairing pairing = Pairing(tree, points, bound, min_overlap, 1 + exponent)
    cdef const double[:, ::1] planes = checks.floats("normals", normals, tree.n, 3)
    cdef Motion motion, best, step, following
    cdef double psi, least_psi = INFINITY
    cdef int iteration = 0, waited = 0
    cdef bint paired
    of_array(checks.transform("transform", transform), motion)
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
    return as_array(best), (*pairs[:3], least_psi, pairs[4]), iteration, waited == PATIENCE


cdef void copy(const double* motion, double* other) noexcept nogil:
    cdef int m
    for m in range(12):
        other[m] = motion[m]


cdef as_array(const double* motion):
    transform = np.eye(4)
    to_array(motion, transform)
    return transform
