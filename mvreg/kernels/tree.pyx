# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""A k-d tree over points in space, balanced, with the box of every node."""

from libc.float cimport DBL_MAX
from libc.math cimport INFINITY, fmax, fmin, sqrt
from libc.stdlib cimport free, malloc

from mvreg.kernels.linear cimport squared_gap

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks

# Points in a leaf, at most; and neighbours that can be asked for.
cdef enum:
    LEAF = 24
    MOST_NEIGHBOURS = 128

# A range is divided by the middle of three; many, by a sample; few are sorted.
cdef enum:
    FEW = 6
    MANY = 2000
    SAMPLE = 128


# The nodes that a search has still to ask, with their squared distances; nearer ones last.
cdef struct Walk:
    Py_ssize_t waiting[128]
    double gaps[128]
    int held


cdef inline Py_ssize_t divide(
    Entry* a, Py_ssize_t low, Py_ssize_t high, double pivot, bint least, int axis
) noexcept nogil:
    """Bring what is below a pivot to the front of [low, high), or what is not above if `least`.

    Returns where the rest begins. There is no branch that could be guessed wrong (Lomuto).
    """
    cdef Py_ssize_t i, end = low
    cdef Entry one
    for i in range(low, high):
        one = a[i]
        a[i] = a[end]
        a[end] = one
        end += (one.x[axis] <= pivot) if least else (one.x[axis] < pivot)
    return end


cdef inline void sort(Entry* a, Py_ssize_t low, Py_ssize_t high, int axis) noexcept nogil:
    """Sort a few entries along an axis."""
    cdef Py_ssize_t i, j
    cdef Entry one
    for i in range(low + 1, high):
        one = a[i]
        j = i
        while j > low and a[j - 1].x[axis] > one.x[axis]:
            a[j] = a[j - 1]
            j -= 1
        a[j] = one


cdef inline void bracket(
    const Entry* a, Py_ssize_t low, Py_ssize_t high, Py_ssize_t k, int axis, double* ends
) noexcept nogil:
    """Two values of a sample that the k-th smallest of [low, high) probably lies between.

    They are three standard deviations of its rank apart (Floyd and Rivest 1975).
    """
    cdef double found[SAMPLE]
    cdef double one, place
    cdef Py_ssize_t i, j
    for i in range(SAMPLE):
        one = a[low + (high - low) * i // SAMPLE].x[axis]
        j = i
        while j > 0 and found[j - 1] > one:
            found[j] = found[j - 1]
            j -= 1
        found[j] = one
    place = <double> (k - low) / (high - low) * SAMPLE
    one = 1.5 * sqrt(place * (1 - place / SAMPLE)) + 1
    ends[0] = found[<Py_ssize_t> fmax(place - one, 0)]
    ends[1] = found[<Py_ssize_t> fmin(place + one, SAMPLE - 1)]


cdef void select(Entry* a, Py_ssize_t low, Py_ssize_t high, Py_ssize_t k, int axis) noexcept nogil:
    """Put the k-th smallest of [low, high) along an axis in its place, smaller ones before it."""
    cdef double ends[2]
    cdef Py_ssize_t middle, before
    cdef double one, two, three, pivot
    cdef int side
    while high - low > FEW:
        before = high - low
        if before > MANY:
            bracket(a, low, high, k, axis, ends)
            for side in range(2):
                middle = divide(a, low, high, ends[side], False, axis)
                if k < middle:
                    high = middle
                    break
                low = middle
            if high - low < before:
                continue
        one, two = a[low].x[axis], a[(low + high) // 2].x[axis]
        three = a[high - 1].x[axis]
        pivot = fmax(fmin(one, two), fmin(fmax(one, two), three))
        middle = divide(a, low, high, pivot, False, axis)
        if k < middle:
            high = middle
            continue
        low = middle
        if high - low == before:  # none is smaller than the pivot
            low = divide(a, low, high, pivot, True, axis)
            if k < low:
                return
    sort(a, low, high, axis)


cdef class Tree:
    """A k-d tree over points (N, 3) that are finite; N may be zero.

    The part of `scipy.spatial.cKDTree` that registration needs, for three dimensions: nodes halve
    their points across the longest side of their box, and know that box, so that a query with a
    distance bound ends early. Nothing in it changes once it is built: threads may share it.

    Parameters
    ----------
    points : (N, 3) array

    Attributes
    ----------
    data : (N, 3) array
        The points.
    n : int
    grain : float
        About how far neighbours on a surface are apart.
    mins, maxes : (3,) arrays
        Their box; infinite, the wrong way round, for no points.
    """

    def __cinit__(self, points):
        cdef Py_ssize_t i
        self.entries = NULL
        self.boxes = NULL
        self.data = checks.floats("points", points, "N", 3, finite=True)
        self.cloud = self.data
        self.n = self.cloud.shape[0]
        self.depth, self.leaves = 0, 1
        while self.leaves * LEAF < self.n:
            self.leaves *= 2
            self.depth += 1
        self.entries = <Entry*> malloc((self.n + 1) * sizeof(Entry))
        self.boxes = <double*> malloc(2 * self.leaves * 6 * sizeof(double))
        if not self.entries or not self.boxes:
            raise MemoryError
        with nogil:
            for i in range(self.n):
                self.entries[i].x[0] = self.cloud[i, 0]
                self.entries[i].x[1] = self.cloud[i, 1]
                self.entries[i].x[2] = self.cloud[i, 2]
                self.entries[i].index = i
            build(self.entries, self.boxes, self.n, self.depth, 0, 1)
            self.grain = grain(self.boxes, self.leaves, self.n)
        self.mins = np.array([self.boxes[2 * i + 1] for i in range(3)])
        self.maxes = np.array([self.boxes[6 + 2 * i + 1] for i in range(3)])

    def __dealloc__(self):
        free(self.entries)
        free(self.boxes)

    def __reduce__(self):
        return Tree, (self.data,)

    def query(self, x, k=1, double distance_upper_bound=INFINITY):
        """The nearest points, nearest first, as `scipy.spatial.cKDTree.query` has it.

        Parameters
        ----------
        x : (M, 3) array
        k : int or list of int
            How many neighbours (at most 128), or which ones, counted from 1.
        distance_upper_bound : float
            Only neighbours nearer than this count.

        Returns
        -------
        distances, indices : (M,), (M, k) or (M, len(k)) arrays
            Infinite, and `n`, where there is no such neighbour.
        """
        if isinstance(k, int) and k == 1:
            return self.nearest(x, distance_upper_bound)
        wanted = (np.arange(1, k + 1) if isinstance(k, int)
                  else checks.indices("k", k, MOST_NEIGHBOURS + 1, "K"))
        if not len(wanted) or wanted.min() < 1:
            raise InputError(f"k: expected 1 to {MOST_NEIGHBOURS} neighbours, got {k}")
        distances, indices = self._many(x, int(wanted.max()), distance_upper_bound)
        return distances[:, wanted - 1], indices[:, wanted - 1]

    def nearest(self, x, double bound=INFINITY):
        """The nearest point to each of x (M, 3) within a bound, as `query` with k = 1."""
        cdef const double[:, ::1] points = checks.floats("x", x, "M", 3)
        cdef Py_ssize_t i, count = points.shape[0]
        distances, indices = np.empty(count), np.empty(count, dtype=np.intp)
        cdef double[::1] far = distances
        cdef Py_ssize_t[::1] which = indices
        cdef double squared, most = squared_bound(bound)
        with nogil:
            for i in range(count):
                squared = most
                which[i] = self.find(&points[i, 0], &squared)
                far[i] = sqrt(squared)
                if which[i] < 0:
                    which[i], far[i] = self.n, INFINITY
        return distances, indices

    def _many(self, x, int k, double bound):
        cdef const double[:, ::1] points = checks.floats("x", x, "M", 3)
        cdef Py_ssize_t i, count = points.shape[0]
        if not 0 < k <= MOST_NEIGHBOURS:
            raise ValueError(f"expected 1 to {MOST_NEIGHBOURS} neighbours, got {k}")
        distances, indices = np.empty((count, k)), np.empty((count, k), dtype=np.intp)
        cdef double[:, ::1] far = distances
        cdef Py_ssize_t[:, ::1] which = indices
        cdef int found, j
        cdef double most = squared_bound(bound)
        with nogil:
            for i in range(count):
                far[i, k - 1] = most
                found = self.find_many(&points[i, 0], k, &far[i, 0], &which[i, 0])
                for j in range(found):
                    far[i, j] = sqrt(far[i, j])
                for j in range(found, k):
                    far[i, j], which[i, j] = INFINITY, self.n
        return distances, indices

    cdef Py_ssize_t find(self, const double* x, double* squared) noexcept nogil:
        """The nearest point nearer than `squared`, which becomes its squared distance; or -1."""
        cdef Py_ssize_t best = -1, i = 0, last = 0
        cdef double least = squared[0], d
        cdef Walk walk
        begin(self, x, &walk)
        while next_leaf(self, x, least, &walk, &i, &last):
            while i < last:
                d = squared_gap(self.entries[i].x, x)
                best = self.entries[i].index if d < least else best
                least = d if d < least else least
                i += 1
        squared[0] = least
        return best

    cdef Py_ssize_t find_two(self, const double* x, double* first, double* second) noexcept nogil:
        """As `find`, and the squared distance of the second nearest, or of the bound, `second`."""
        cdef Py_ssize_t best = -1, i = 0, last = 0
        cdef double least = second[0], next_least = second[0], d
        cdef Walk walk
        begin(self, x, &walk)
        while next_leaf(self, x, next_least, &walk, &i, &last):
            while i < last:
                d = squared_gap(self.entries[i].x, x)
                best = self.entries[i].index if d < least else best
                next_least = least if d < least else d if d < next_least else next_least
                least = d if d < least else least
                i += 1
        if best >= 0:
            first[0], second[0] = least, next_least
        return best

    cdef int find_many(
        self, const double* x, int k, double* squared, Py_ssize_t* which
    ) noexcept nogil:
        """The k nearest points nearer than ``squared[k - 1]``, in ascending order; how many."""
        cdef Py_ssize_t i = 0, last = 0
        cdef double least = squared[k - 1], d
        cdef int found = 0, place
        cdef Walk walk
        begin(self, x, &walk)
        while next_leaf(self, x, least, &walk, &i, &last):
            while i < last:
                d = squared_gap(self.entries[i].x, x)
                if d < least:
                    place = found if found < k else k - 1
                    while place > 0 and squared[place - 1] > d:
                        squared[place], which[place] = squared[place - 1], which[place - 1]
                        place -= 1
                    squared[place], which[place] = d, self.entries[i].index
                    if found < k:
                        found += 1
                    if found == k:
                        least = squared[k - 1]
                i += 1
        return found


cdef inline void begin(Tree tree, const double* x, Walk* walk) noexcept nogil:
    """Begin a search at the root; over before it begins where there are no points."""
    walk.held = tree.n > 0
    walk.waiting[0], walk.gaps[0] = 1, node_distance(tree.boxes, 1, x)


cdef inline bint next_leaf(
    Tree tree, const double* x, double least, Walk* walk, Py_ssize_t* start, Py_ssize_t* stop
) noexcept nogil:
    """Where the entries of the next leaf that is nearer than `least` are; False at the end."""
    cdef Py_ssize_t node
    while walk.held:
        walk.held -= 1
        if walk.gaps[walk.held] < least:
            node = descend(tree, x, least, walk)
            if node:
                start[0] = (tree.n * (node - tree.leaves)) >> tree.depth
                stop[0] = (tree.n * (node - tree.leaves + 1)) >> tree.depth
                return True
    return False


cdef inline Py_ssize_t descend(
    Tree tree, const double* x, double least, Walk* walk
) noexcept nogil:
    """The leaf below the last node that waited, always on the nearer side; 0 if none is near.

    That is, nearer than `least`. Farther sides that are go on waiting, with their distances.
    """
    cdef double apart[2]
    cdef Py_ssize_t node = walk.waiting[walk.held], near
    while node < tree.leaves:
        child_distances(tree.boxes, node, x, apart)
        near = apart[0] > apart[1]
        node = 2 * node + near
        if apart[near] >= least:
            return 0
        walk.waiting[walk.held], walk.gaps[walk.held] = node ^ 1, apart[1 - near]
        walk.held += apart[1 - near] < least
    return node


cdef double squared_bound(double bound) noexcept nogil:
    """The square of a bound that loses no neighbour that is nearer, whatever its size."""
    return bound * bound if bound < 1e150 else DBL_MAX


cdef double grain(const double* boxes, Py_ssize_t leaves, Py_ssize_t n) noexcept nogil:
    """About how far neighbours on a surface are apart, told from the boxes of the leaves."""
    cdef double total = 0, side
    cdef const double* box
    cdef Py_ssize_t node
    cdef int axis
    if n == 0:
        return 0
    for node in range(leaves, 2 * leaves):
        box = &boxes[12 * (node >> 1) + (node & 1)]
        side = 0
        for axis in range(3):
            side = fmax(side, box[6 + 2 * axis] - box[2 * axis])
        total += side
    return total / leaves / sqrt(<double> n / leaves)


cdef void build(
    Entry* entries, double* boxes, Py_ssize_t n, int depth, int level, Py_ssize_t node
) noexcept nogil:
    """Sort the entries of a node into its subtree, and find its box."""
    cdef Py_ssize_t place = node - (<Py_ssize_t> 1 << level)
    cdef Py_ssize_t low = (n * place) >> level, high = (n * (place + 1)) >> level, i
    cdef double* box = &boxes[12 * (node >> 1) + (node & 1)]
    cdef double least[3]
    cdef double most[3]
    cdef int axis, longest = 0
    for axis in range(3):
        least[axis], most[axis] = INFINITY, -INFINITY
    for i in range(low, high):
        for axis in range(3):
            least[axis] = entries[i].x[axis] if entries[i].x[axis] < least[axis] else least[axis]
            most[axis] = entries[i].x[axis] if entries[i].x[axis] > most[axis] else most[axis]
    for axis in range(3):
        box[2 * axis], box[6 + 2 * axis] = least[axis], most[axis]
    if level == depth:
        return
    for axis in range(1, 3):
        if box[6 + 2 * axis] - box[2 * axis] > box[6 + 2 * longest] - box[2 * longest]:
            longest = axis
    select(entries, low, high, (n * (2 * place + 1)) >> (level + 1), longest)
    build(entries, boxes, n, depth, level + 1, 2 * node)
    build(entries, boxes, n, depth, level + 1, 2 * node + 1)
