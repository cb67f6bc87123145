# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Closest points, trimmed exactly to the least psi.

A search that comes to rest asks for the same neighbours many times. Each point remembers where it
was when it was last looked up, and how far all other points of the tree were from there: as long
as it has moved less than that allows its neighbour is the same, and costs one distance.
"""

from libc.math cimport INFINITY, ceil, fmax, fmin, pow, sqrt
from libc.stdint cimport uint64_t
from libc.string cimport memcpy, memset
from libcpp.algorithm cimport sort

from mvreg.kernels.helper cimport Helper
from mvreg.kernels.linear cimport Motion, kabsch, move, of_array, outer_sum, squared_gap
from mvreg.kernels.tree cimport Tree

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks
from mvreg.kernels.results import TrimmedPairs

cdef double ROUNDING = 1 - 1e-12
cdef double NARROW = 1.25
# Squared lengths that are not quite zero.
cdef double LEAST = 1e-300
# Of the bits of a distance, from the top; and points that are worth a second thread's while.
cdef enum:
    BYTES = 4
    MANY = 1500


cdef class Pairing:
    """The closest points of a cloud that moves over a tree, trimmed to the least psi, Eq. (4)."""

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
        cdef int a
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
            outer_sum(h, p, here, q, there)
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
        return TrimmedPairs(chosen, targets, distances, self.objective, self.bound)


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
    TrimmedPairs
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
