# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""Nearest descriptors among those of other scans: a k-d tree of any dimension."""

from libc.math cimport INFINITY
from libcpp.vector cimport vector

from mvreg.kernels.simd cimport WIDE

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks

# Rows in a leaf, at most; and neighbours that can be asked for.
cdef enum:
    LEAF = 16
    MOST = 64


cdef extern from *:
    """
    // Squared distances of a row from the 16 of a leaf, which lie number by number. No branch: to
    // leave off where one is too far takes longer.
    #if defined(__GNUC__) && !defined(__clang__)
    typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));
    MVREG_CLONES static void distances_to(
        const double* row, const double* leaf, Py_ssize_t width, double* squared
    ) {
        Four one = {0, 0, 0, 0}, two = one, three = one, four = one;
        for (Py_ssize_t k = 0; k < width; k++) {
            const Four* at = (const Four*) (leaf + 16 * k);
            const Four a = row[k] - at[0], b = row[k] - at[1], c = row[k] - at[2];
            const Four d = row[k] - at[3];
            one += a * a, two += b * b, three += c * c, four += d * d;
        }
        Four* to = (Four*) squared;
        to[0] = one, to[1] = two, to[2] = three, to[3] = four;
    }
    #else
    static void distances_to(
        const double* row, const double* leaf, Py_ssize_t width, double* squared
    ) {
        for (int j = 0; j < 16; j++)
            squared[j] = 0;
        for (Py_ssize_t k = 0; k < width; k++)
            for (int j = 0; j < 16; j++) {
                const double gap = row[k] - leaf[16 * k + j];
                squared[j] += gap * gap;
            }
    }
    #endif
    """
    void distances_to(
        const double* row, const double* leaf, Py_ssize_t width, double* squared
    ) noexcept nogil


cdef class DescriptorTree:
    """A k-d tree over descriptors (M, D), each of which belongs to a scan.

    Nodes halve their rows across the dimension in which they spread most. Nothing in it changes
    once it is built: threads may share it.

    Parameters
    ----------
    rows : (M, D) array
        Finite; M may be zero.
    owners : (M,) array of integers
        Whose they are.
    """

    cdef const double[:, ::1] rows  # in the order of the leaves
    cdef const Py_ssize_t[::1] owners
    cdef Py_ssize_t[::1] places  # of the rows as they were given
    cdef vector[int] axes
    cdef vector[double] splits
    cdef vector[double] blocks  # the rows of each leaf, number by number
    cdef Py_ssize_t leaves, size, width

    def __cinit__(self, rows, owners):
        given = checks.floats("rows", rows, "M", "D", finite=True)
        whose = checks.integers("owners", owners, len(given))
        if not given.shape[1]:
            raise InputError(f"rows: expected descriptors of one number or more, got {given.shape}")
        cdef const double[:, ::1] values = given
        order = np.arange(len(given), dtype=np.intp)
        cdef Py_ssize_t[::1] ids = order
        cdef Py_ssize_t node, first, last
        self.size, self.width, self.leaves = values.shape[0], values.shape[1], 1
        while self.size > LEAF * self.leaves:
            self.leaves *= 2
        self.axes.resize(self.leaves)
        self.splits.resize(self.leaves)
        with nogil:
            for node in range(1, self.leaves):
                self.bounds(node, &first, &last)
                self.halve(values, ids, node, first, last)
        self.rows = given[order]
        self.owners = whose[order]
        places = np.empty(len(order), dtype=np.intp)
        places[order] = np.arange(len(order))
        self.places = places
        with nogil:
            self.arrange()

    cdef void arrange(self) noexcept nogil:
        """Lay out the rows leaf by leaf; where one has fewer than 16, the rest is far away."""
        cdef Py_ssize_t leaf, first, last, i, k
        self.blocks.assign(self.leaves * self.width * LEAF, INFINITY)
        for leaf in range(self.leaves):
            self.bounds(self.leaves + leaf, &first, &last)
            for i in range(first, last):
                for k in range(self.width):
                    self.blocks[(leaf * self.width + k) * LEAF + i - first] = self.rows[i, k]

    cdef void bounds(self, Py_ssize_t node, Py_ssize_t* first, Py_ssize_t* last) noexcept nogil:
        """The rows of a node: those of its level, the root's being one, share all rows evenly."""
        cdef Py_ssize_t level = 1
        while 2 * level <= node:
            level *= 2
        first[0] = self.size * (node - level) // level
        last[0] = self.size * (node - level + 1) // level

    cdef void halve(
        self, const double[:, ::1] values, Py_ssize_t[::1] ids, Py_ssize_t node,
        Py_ssize_t first, Py_ssize_t last,
    ) noexcept nogil:
        """Order the rows of a node across the dimension in which they spread most."""
        cdef Py_ssize_t i, middle, ignored
        cdef int axis, best = 0
        cdef double low, high, most = -1
        for axis in range(self.width):
            low, high = INFINITY, -INFINITY
            for i in range(first, last):
                if values[ids[i], axis] < low:
                    low = values[ids[i], axis]
                if values[ids[i], axis] > high:
                    high = values[ids[i], axis]
            if high - low > most:
                most, best = high - low, axis
        self.bounds(2 * node + 1, &middle, &ignored)
        select(values, ids, first, last, middle, best)
        self.axes[node], self.splits[node] = best, values[ids[middle], best]

    def foreign(self, which, int count, double slack=0.0):
        """The owners of the nearest rows that are not of the asking row's own scan.

        Parameters
        ----------
        which : (Q,) array of integers
            The rows that ask, by their places in `rows`.
        count : int
            How many neighbours, 1 to 64.
        slack : float
            A neighbour found is at most ``1 + slack`` times as far as the true one of its rank
            (Arya et al. 1998); 0 finds the true ones.

        Returns
        -------
        (Q, count) array of integers
            Nearest first; -1 where there are not so many.
        """
        if not 0 < count <= MOST:
            raise ValueError(f"expected 1 to {MOST} neighbours, got {count}")
        cdef const Py_ssize_t[::1] asked = checks.indices("which", which, self.size, "Q")
        found = np.full((asked.shape[0], count), -1, dtype=np.intp)
        cdef Py_ssize_t[:, ::1] owners = found
        cdef double squared[MOST]
        cdef vector[double] gaps
        cdef Py_ssize_t i, k, row
        cdef double looser = (1 + slack) * (1 + slack)
        with nogil:
            for i in range(asked.shape[0]):
                row = self.places[asked[i]]
                gaps.assign(self.width, 0.0)
                for k in range(count):
                    squared[k] = INFINITY
                self.look(1, row, 0.0, looser, gaps.data(), count, squared, &owners[i, 0])
        return found

    cdef void look(
        self, Py_ssize_t node, Py_ssize_t row, double bound, double looser, double* gaps,
        int count, double* squared, Py_ssize_t* owners,
    ) noexcept nogil:
        """Go through a node that is no nearer than the root of `bound`: the near half first."""
        cdef const double* x = &self.rows[row, 0]
        cdef double gap, kept, other
        cdef Py_ssize_t near, axis
        if node >= self.leaves:
            self.scan(node, row, count, squared, owners)
            return
        axis = self.axes[node]
        gap = x[axis] - self.splits[node]
        near = 2 * node + (gap >= 0)
        self.look(near, row, bound, looser, gaps, count, squared, owners)
        kept = gaps[axis]
        other = bound - kept * kept + gap * gap
        if other * looser < squared[count - 1]:
            gaps[axis] = gap
            self.look(near ^ 1, row, other, looser, gaps, count, squared, owners)
            gaps[axis] = kept

    cdef void scan(
        self, Py_ssize_t node, Py_ssize_t row, int count, double* squared, Py_ssize_t* owners
    ) noexcept nogil:
        """Take what is nearer than the farthest neighbour so far out of a leaf."""
        cdef Py_ssize_t i, k, first, last, own = self.owners[row]
        cdef double total
        cdef double totals[LEAF]
        first = self.size * (node - self.leaves) // self.leaves
        last = self.size * (node - self.leaves + 1) // self.leaves
        distances_to(
            &self.rows[row, 0], &self.blocks[(node - self.leaves) * self.width * LEAF], self.width,
            totals)
        for i in range(first, last):
            total = totals[i - first]
            if not total < squared[count - 1] or self.owners[i] == own:
                continue
            k = count - 1
            while k > 0 and squared[k - 1] > total:
                squared[k], owners[k] = squared[k - 1], owners[k - 1]
                k -= 1
            squared[k], owners[k] = total, self.owners[i]


cdef void select(
    const double[:, ::1] values, Py_ssize_t[::1] ids, Py_ssize_t low, Py_ssize_t high,
    Py_ssize_t k, int axis,
) noexcept nogil:
    """Put the k-th smallest of ids [low, high), by a column, in its place (Hoare's quickselect)."""
    cdef Py_ssize_t i, j, held
    cdef double pivot
    high -= 1
    while low < high:
        pivot = values[ids[(low + high) // 2], axis]
        i, j = low, high
        while i <= j:
            while values[ids[i], axis] < pivot:
                i += 1
            while pivot < values[ids[j], axis]:
                j -= 1
            if i <= j:
                held = ids[i]
                ids[i], ids[j] = ids[j], held
                i += 1
                j -= 1
        if k <= j:
            high = j
        elif k >= i:
            low = i
        else:
            return
