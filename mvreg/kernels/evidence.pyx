# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""What the points of one scan show on the surface of another, and before what its sensor saw.

A meeting of two scans is one pass over the points of each, and leaves sums: about a centre that is
near, so that nothing cancels however far away the scans' frames begin. From these follows whatever
is asked of the points together, in any frame.
"""

from libc.math cimport INFINITY, ceil, fabs, floor, fmax, fmin, sqrt
from libc.stdint cimport int64_t, uint64_t
from libcpp.algorithm cimport sort
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport Motion, cross, move, norm, of_array, turn
from mvreg.kernels.tree cimport Tree, node_distance

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks

# Rays that answer for a point, at most; cells between them; numbers that are summed up over the points that meet.
cdef enum:
    MOST_RAYS = 64
    MOST_RINGS = 8
    SUMS = 83
# Of vectors shorter than this times another the direction is lost in rounding.
cdef double SHORT = 1e-6
cdef double LEAST = 2.2250738585072014e-308
# Rays in a cell.
cdef double FILL = 2.0

cdef struct Ray:
    double x[3]  # where it is across the others
    double height


cdef class Rays:
    """The rays of a range image in the cells of a grid, to be asked for those beside a point.

    Built in a third of the time of a tree, and asked in half. The cells are squares in the picture
    that a sensor far away would see. Where rays meet, the
    picture shows the sphere on which they are told apart, from the side where most of them are:
    neighbours on the sphere are neighbours in the picture.

    Parameters
    ----------
    points : (N, 3) array
        What the sensor saw, finite.
    direction : (3,) array or None
        Unit, towards a sensor far away: the rays are parallel.
    origin : (3,) array or None
        The sensor's position, where there is no direction: the rays meet there. Then distances
        between rays are those on a sphere of the points' mean distance.
    reach : float
        Only rays nearer to a point than this answer for it (length).
    """

    cdef vector[Ray] rays
    cdef vector[Py_ssize_t] first
    cdef double frame[9]
    cdef double origin[3]
    cdef double least[2]
    cdef double most[2]
    cdef double low[2]
    cdef double high[2]
    cdef Py_ssize_t size[2]
    cdef Py_ssize_t rings
    cdef double distance, reach, edge
    cdef bint central

    def __cinit__(self, points, direction, origin, double reach):
        cdef const double[:, ::1] given = checks.floats("points", points, "N", 3, finite=True)
        cdef const double[::1] vector = (
            checks.floats("origin", origin, 3, finite=True) if direction is None
            else checks.floats("direction", direction, 3, finite=True))
        cdef Py_ssize_t count = given.shape[0], i
        cdef int k
        if reach == INFINITY:
            raise InputError("reach: expected a finite number, got inf")
        self.reach = reach
        self.central = direction is None
        self.distance = 1
        for k in range(3):
            self.origin[k] = vector[k] if self.central else 0
        for k in range(2):
            self.least[k], self.most[k] = INFINITY, -INFINITY
        if not reach > 0:
            count = 0
        self.rays.resize(count)
        with nogil:
            if self.central:
                self.aim(given, count)
            else:
                frame_of(&vector[0], self.frame)
            for i in range(count):
                self.project(&given[i, 0], &self.rays[i])
                for k in range(2):
                    self.least[k] = fmin(self.least[k], self.rays[i].x[k])
                    self.most[k] = fmax(self.most[k], self.rays[i].x[k])
            self.arrange()

    cdef void aim(self, const double[:, ::1] points, Py_ssize_t count) noexcept nogil:
        """The mean distance of the points, and a frame about the mean direction of the rays."""
        cdef double mean[3]
        cdef double away[3]
        cdef double total = 0, length
        cdef Py_ssize_t i
        cdef int k
        for k in range(3):
            mean[k] = 0
        for i in range(count):
            for k in range(3):
                away[k] = points[i, k] - self.origin[k]
            length = norm(away)
            total += length
            for k in range(3):
                mean[k] += away[k] / fmax(length, LEAST)
        if total > 0:
            self.distance = total / count
        length = norm(mean)
        if not length > SHORT * count:  # from all around: any side will do
            mean[0], mean[1], mean[2] = 0, 0, 1
            length = 1
        for k in range(3):
            mean[k] /= length
        frame_of(mean, self.frame)

    cdef void project(self, const double* x, Ray* ray) noexcept nogil:
        """Where the ray through a point is in the picture, how deep on the sphere, its height."""
        cdef double away[3]
        cdef double length, unit
        cdef int k
        if self.central:
            for k in range(3):
                away[k] = x[k] - self.origin[k]
            length = norm(away)
            unit = fmax(length, LEAST)
            for k in range(3):
                away[k] = self.distance * (away[k] / unit)
            turn(self.frame, away, ray.x)
            ray.height = -length
        else:
            turn(self.frame, x, ray.x)
            ray.height = ray.x[2]
            ray.x[2] = 0

    cdef inline Py_ssize_t place(self, double x, int axis) noexcept nogil:
        """The row or column; what is outside of the grid counts to its border."""
        cdef double at = (x - self.low[axis]) / self.edge
        return <Py_ssize_t> fmin(fmax(at, 0), self.size[axis] - 1)

    cdef inline Py_ssize_t cell(self, const Ray* ray) noexcept nogil:
        return self.place(ray.x[0], 0) * self.size[1] + self.place(ray.x[1], 1)

    cdef void span(self) noexcept nogil:
        """Where the grid begins and ends: a few stray points do not make it large."""
        cdef vector[double] some
        cdef size_t count = self.rays.size(), i
        cdef int k
        for k in range(2):
            self.low[k], self.high[k] = 0, 0
            some.clear()
            i = 0
            while i < count:
                if fabs(self.rays[i].x[k]) < INFINITY:
                    some.push_back(self.rays[i].x[k])
                i += count // 1000 + 1
            if some.size():
                sort(some.begin(), some.end())
                self.low[k] = some[some.size() // 100]
                self.high[k] = some[some.size() - 1 - some.size() // 100]
            if not self.high[k] - self.low[k] < INFINITY:
                self.low[k], self.high[k] = 0, 0

    cdef Py_ssize_t divide(self, double edge) noexcept nogil:
        """Count the rays of each cell, one place too late; how many cells are not empty."""
        cdef Py_ssize_t count = self.rays.size(), occupied = 0, i
        cdef double area
        cdef int k
        self.edge = fmax(edge / 2, LEAST)
        area = INFINITY
        while not area <= 4.0 * count + 1000:
            self.edge *= 2
            area = 1
            for k in range(2):
                area *= floor((self.high[k] - self.low[k]) / self.edge) + 1
        for k in range(2):
            self.size[k] = <Py_ssize_t> ((self.high[k] - self.low[k]) / self.edge) + 1
        self.first.assign(self.size[0] * self.size[1] + 1, 0)
        for i in range(count):
            self.first[self.cell(&self.rays[i]) + 1] += 1
        for i in range(1, <Py_ssize_t> self.first.size()):
            occupied += self.first[i] > 0
        return occupied

    cdef void arrange(self) noexcept nogil:
        """Put the rays of each cell beside each other, in their order."""
        cdef vector[Ray] sorted
        cdef vector[Py_ssize_t] filled
        cdef Py_ssize_t count = self.rays.size(), i, occupied
        cdef double each = 1
        self.span()
        self.edge, self.rings = 1, 1
        self.size[0], self.size[1] = 1, 1
        self.first.assign(2, 0)
        if count:
            occupied = self.divide(self.reach)
            each = fmin(fmax(sqrt(<double> count / occupied / FILL), 1), MOST_RINGS)
            self.divide(self.reach / floor(each))
            self.rings = <Py_ssize_t> ceil(self.reach / self.edge * (1 - 1e-12))
        for i in range(1, <Py_ssize_t> self.first.size()):
            self.first[i] += self.first[i - 1]
        filled = self.first
        sorted.resize(count)
        for i in range(count):
            sorted[filled[self.cell(&self.rays[i])]] = self.rays[i]
            filled[self.cell(&self.rays[i])] += 1
        self.rays.swap(sorted)

    cdef int ask(
        self, const double* x, int most, double* height, double* low, double* high
    ) noexcept nogil:
        """How many of the nearest rays answer for a point, and the span of their heights."""
        cdef double far[MOST_RAYS]
        cdef double heights[MOST_RAYS]
        cdef double least = self.reach * self.reach, gap = INFINITY, inside
        cdef Py_ssize_t at[2]
        cdef Py_ssize_t ring, i
        cdef int found = 0, axis, place
        cdef Ray one
        self.project(x, &one)
        height[0] = one.height
        for axis in range(2):
            if (one.x[axis] <= self.least[axis] - self.reach
                    or one.x[axis] >= self.most[axis] + self.reach):
                return 0
        for axis in range(2):
            at[axis] = self.place(one.x[axis], axis)
            inside = one.x[axis] - self.low[axis] - at[axis] * self.edge
            gap = fmin(gap, fmin(inside, self.edge - inside))
        gap = fmax(gap, 0) * (1 - 1e-9)
        for i in range(at[0] - 1, at[0] + 2):
            self.pick(i, at[1] - 1, at[1] + 1, &one, most, far, heights, &found, &least)
        for ring in range(2, self.rings + 1):
            inside = (ring - 1) * self.edge + gap
            if inside * inside >= least:
                break
            for i in range(at[0] - ring + 1, at[0] + ring):
                self.pick(i, at[1] - ring, at[1] - ring, &one, most, far, heights, &found, &least)
                self.pick(i, at[1] + ring, at[1] + ring, &one, most, far, heights, &found, &least)
            i = at[0] - ring
            self.pick(i, at[1] - ring, at[1] + ring, &one, most, far, heights, &found, &least)
            i = at[0] + ring
            self.pick(i, at[1] - ring, at[1] + ring, &one, most, far, heights, &found, &least)
        low[0], high[0] = INFINITY, -INFINITY
        for place in range(found):
            low[0] = fmin(low[0], heights[place])
            high[0] = fmax(high[0], heights[place])
        return found

    cdef inline void pick(
        self, Py_ssize_t row, Py_ssize_t begin, Py_ssize_t end, const Ray* one, int most,
        double* far, double* heights, int* found, double* least
    ) noexcept nogil:
        """Put the rays of some cells of a row among the nearest so far, nearest first."""
        cdef Py_ssize_t r
        cdef double a, b, c, d
        cdef int place
        cdef const Ray* ray
        if row < 0 or row >= self.size[0]:
            return
        begin = begin if begin > 0 else 0
        end = end if end < self.size[1] else self.size[1] - 1
        if begin > end:
            return
        begin += row * self.size[1]
        end += row * self.size[1]
        for r in range(self.first[begin], self.first[end + 1]):
            ray = &self.rays[r]
            a, b, c = ray.x[0] - one.x[0], ray.x[1] - one.x[1], ray.x[2] - one.x[2]
            d = a * a + b * b + c * c
            if not d < least[0]:
                continue
            place = found[0] if found[0] < most else most - 1
            while place > 0 and far[place - 1] > d:
                far[place], heights[place] = far[place - 1], heights[place - 1]
                place -= 1
            far[place], heights[place] = d, ray.height
            if found[0] < most:
                found[0] += 1
            if found[0] == most:
                least[0] = far[most - 1]

    cdef bint beside(self, const double* x, double radius) noexcept nogil:
        """Whether any ray may answer for a point within a radius of another; True if in doubt."""
        cdef Ray one
        cdef double away[3]
        cdef double length, sine
        cdef int axis
        if self.rays.size() == 0:
            return False
        radius *= 1 + 1e-9
        if self.central:
            for axis in range(3):
                away[axis] = x[axis] - self.origin[axis]
            length = norm(away)
            if length <= radius:  # the ball is seen under any angle
                return True
            sine = radius / length  # of the angle between the ball's middle and its edge
            radius = self.distance * sine * sqrt(2 / (1 + sqrt(1 - sine * sine)))  # their chord
            radius *= 1 + 1e-9
        self.project(x, &one)
        radius += self.reach
        for axis in range(2):
            if one.x[axis] < self.least[axis] - radius or one.x[axis] > self.most[axis] + radius:
                return False
        return True

    def nearby(self, points, int most):
        """Heights (M,) of points (M, 3), and of the nearest rays about each: the span of them.

        At most `most` rays answer for a point (64). Without any the span is NaN.

        Returns
        -------
        height, low, high : (M,) arrays
        """
        cdef const double[:, ::1] given = checks.floats("points", points, "M", 3)
        cdef Py_ssize_t count = given.shape[0], i
        check_rays(most)
        own, lowest, highest = np.empty(count), np.full(count, np.nan), np.full(count, np.nan)
        cdef double[::1] height = own, low = lowest, high = highest
        cdef double a, b, c
        with nogil:
            for i in range(count):
                if self.ask(&given[i, 0], most, &a, &b, &c):
                    low[i], high[i] = b, c
                height[i] = a
        return own, lowest, highest


cdef int check_rays(int most) except -1:
    if not 0 < most <= MOST_RAYS:
        raise ValueError(f"expected 1 to {MOST_RAYS} rays, got {most}")
    return 0


cdef void frame_of(const double* direction, double* frame) noexcept nogil:
    """Rows: two unit vectors at right angles to a unit direction, and the direction."""
    cdef int k, least = 0
    cdef double length
    for k in range(1, 3):
        if fabs(direction[k]) < fabs(direction[least]):
            least = k
    for k in range(3):
        frame[k] = (1.0 if k == least else 0.0) - direction[least] * direction[k]
        frame[6 + k] = direction[k]
    length = norm(frame)
    for k in range(3):
        frame[k] /= length
    cross(&frame[6], frame, &frame[3])


cdef inline void turn_back(const double* motion, const double* x, double* turned) noexcept nogil:
    cdef int i
    for i in range(3):
        turned[i] = motion[i] * x[0] + motion[3 + i] * x[1] + motion[6 + i] * x[2]


def look(
    Tree tree not None, planes, points, normals, centre, double radius, transform, double reach,
    double least_cosine, bint oriented, Rays rays, int most_rays, double tolerance
):
    """What points show on a surface, and before what was seen there, in one pass.

    Parameters
    ----------
    tree : Tree
        Of the still scan's points.
    planes : (T, 3) array
        Their unit normals.
    points, normals : (P, 3) arrays
        Of the scan that moves, in its frame.
    centre, radius
        Of a ball around these points: (3,) array and length.
    transform : (4, 4) array
        ``T_still_moving``.
    reach : float
        A point with no neighbour nearer than this is not on the surface (length).
    least_cosine : float
        Between normals that agree.
    oriented : bool
        False if the signs of the normals mean nothing.
    rays : Rays or None
        What the still scan's sensor saw.
    most_rays : int
        So many of its rays answer for a point.
    tolerance : float
        So far before the surface about its ray a point is still on it (length).

    Returns
    -------
    met : (P,) array of bool
        The points on the surface, normals agreeing.
    near, consistent, front : int
        Points that near, whatever their normals; those on what the sensor saw, and before it.
    sums : (83,) array
        Over the points that met, with p about `centre` (length), their own normals n, the planes' m
        turned into the moving frame, and their heights h over these planes (length):
        ``h^2``, ``p`` (3), ``p^2``, the products of ``[p x n, n]`` and ``[p x m, m]`` (6, 6), of
        ``[p x m, m]`` and itself (6, 6) and ``h [p x m, m]`` (6).
    """
    cdef const double[:, ::1] given = checks.floats("points", points, "P", 3)
    cdef const double[:, ::1] own = checks.floats("normals", normals, given.shape[0], 3)
    cdef const double[:, ::1] other = checks.floats("planes", planes, tree.n, 3)
    cdef const double[::1] middle = checks.floats("centre", centre, 3)
    cdef Py_ssize_t count = given.shape[0], near = 0, consistent = 0, front = 0, i, partner
    cdef bint surface, seen
    cdef double x[3]
    cdef double squared, height, low, high
    cdef Motion motion
    of_array(checks.transform("transform", transform), motion)
    check_rays(most_rays)
    flags, sums = np.zeros(count, dtype=np.uint8), np.zeros(SUMS)
    cdef unsigned char[::1] met = flags
    cdef double[::1] total = sums
    with nogil:
        move(motion, &middle[0], x)
        surface = tree.n > 0 and node_distance(tree.boxes, 1, x) <= (
            (radius * (1 + 1e-9) + reach) * (radius * (1 + 1e-9) + reach)
        )
        seen = rays is not None and rays.beside(x, radius)
        if surface or seen:
            for i in range(count):
                move(motion, &given[i, 0], x)
                if surface:
                    squared = reach * reach
                    partner = tree.find(x, &squared)
                    if partner >= 0:
                        near += 1
                        met[i] = add(
                            &total[0], motion, x, &given[i, 0], &middle[0], &own[i, 0],
                            &other[partner, 0], &tree.cloud[partner, 0], least_cosine, oriented,
                        )
                if seen and rays.ask(x, most_rays, &height, &low, &high):
                    if height > high + tolerance:
                        front += 1
                    elif not height < low - tolerance:
                        consistent += 1
    return flags.view(np.bool_), near, consistent, front, sums


cdef bint add(
    double* total, const double* motion, const double* x, const double* point,
    const double* centre, const double* normal, const double* plane, const double* partner,
    double least_cosine, bint oriented
) noexcept nogil:
    """Add a point to the sums if it lies on the plane of its partner; whether it does."""
    cdef double first[6]
    cdef double second[6]
    cdef double p[3]
    cdef double turned[3]
    cdef double cosine, height
    cdef int j, k
    turn(motion, normal, turned)
    cosine = turned[0] * plane[0] + turned[1] * plane[1] + turned[2] * plane[2]
    if not (cosine if oriented else fabs(cosine)) > least_cosine:
        return False
    height = ((x[0] - partner[0]) * plane[0] + (x[1] - partner[1]) * plane[1]
              + (x[2] - partner[2]) * plane[2])
    turn_back(motion, plane, &second[3])
    if cosine < 0:  # only where signs mean nothing
        height = -height
        for k in range(3):
            second[3 + k] = -second[3 + k]
    for k in range(3):
        p[k] = point[k] - centre[k]
        first[3 + k] = normal[k]
    cross(p, &first[3], first)
    cross(p, &second[3], second)
    total[0] += height * height
    for k in range(3):
        total[1 + k] += p[k]
    total[4] += p[0] * p[0] + p[1] * p[1] + p[2] * p[2]
    for j in range(6):
        for k in range(6):
            total[5 + 6 * j + k] += first[j] * second[k]
            total[41 + 6 * j + k] += second[j] * second[k]
        total[77 + j] += height * second[j]
    return True


def may_meet(
    centre, double radius, Rays rays, other_centre, double other_radius, Rays other_rays,
    transform, double reach
):
    """Whether `look` could find anything either way between two scans; True if in doubt.

    Parameters
    ----------
    centre, radius, rays
        Of the scan that moves: a ball around its points, and what its sensor saw.
    other_centre, other_radius, other_rays
        Of the still scan.
    transform : (4, 4) array
        ``T_still_moving``.
    reach : float
        As in `look`, the larger one of the two scans (length).
    """
    cdef const double[::1] own = checks.floats("centre", centre, 3)
    cdef const double[::1] other = checks.floats("other_centre", other_centre, 3)
    cdef double x[3]
    cdef double y[3]
    cdef double gap
    cdef int k
    cdef Motion motion
    of_array(checks.transform("transform", transform), motion)
    move(motion, &own[0], x)
    gap = 0
    for k in range(3):
        y[k] = other[k] - motion[9 + k]
        gap += (x[k] - other[k]) * (x[k] - other[k])
    if sqrt(gap) <= (radius + other_radius) * (1 + 1e-9) + reach:
        return True
    if other_rays is not None and other_rays.beside(x, radius):
        return True
    turn_back(motion, y, x)
    return rays is not None and rays.beside(x, other_radius)


def touch(Tree tree not None, planes, points, normals, transform, double reach, double least_cosine):
    """Where points lie on a surface, and how far from its planes.

    Parameters as in `look`; signs of normals do not matter.

    Returns
    -------
    which : (M,) array
        Positions among the points, ascending.
    heights : (M,) array
        Distances from the planes (length).
    """
    cdef const double[:, ::1] given = checks.floats("points", points, "P", 3)
    cdef const double[:, ::1] own = checks.floats("normals", normals, given.shape[0], 3)
    cdef const double[:, ::1] other = checks.floats("planes", planes, tree.n, 3)
    cdef Py_ssize_t count = given.shape[0], found = 0, i, partner
    cdef double x[3]
    cdef double turned[3]
    cdef double squared, cosine
    cdef const double* plane
    cdef Motion motion
    of_array(checks.transform("transform", transform), motion)
    which, heights = np.empty(count, dtype=np.intp), np.empty(count)
    cdef Py_ssize_t[::1] place = which
    cdef double[::1] height = heights
    with nogil:
        for i in range(count):
            move(motion, &given[i, 0], x)
            squared = reach * reach
            partner = tree.find(x, &squared)
            if partner < 0:
                continue
            plane = &other[partner, 0]
            turn(motion, &own[i, 0], turned)
            cosine = turned[0] * plane[0] + turned[1] * plane[1] + turned[2] * plane[2]
            if not fabs(cosine) > least_cosine:
                continue
            place[found] = i
            height[found] = fabs((x[0] - tree.cloud[partner, 0]) * plane[0]
                                 + (x[1] - tree.cloud[partner, 1]) * plane[1]
                                 + (x[2] - tree.cloud[partner, 2]) * plane[2])
            found += 1
    return which[:found].copy(), heights[:found].copy()


def box(points, transform):
    """The least and largest coordinates (3,) of points (N, 3) that are moved."""
    cdef const double[:, ::1] given = checks.floats("points", points, "N", 3)
    cdef Py_ssize_t i
    cdef double x[3]
    cdef int k
    cdef Motion motion
    of_array(checks.transform("transform", transform), motion)
    lowest, highest = np.full(3, np.inf), np.full(3, -np.inf)
    cdef double[::1] low = lowest, high = highest
    with nogil:
        for i in range(given.shape[0]):
            move(motion, &given[i, 0], x)
            for k in range(3):
                if x[k] < low[k]:
                    low[k] = x[k]
                if x[k] > high[k]:
                    high[k] = x[k]
    return lowest, highest


cdef struct Pixel:
    int64_t key
    double top


def hidden(points, directions, landmark, double cell, double depth):
    """Shares (D,) of points (N, 3) that others hide from a sensor far away in each direction.

    A point is hidden by one of the same cell of the picture that is so much nearer.

    Parameters
    ----------
    points : (N, 3) array
    directions : (D, 3) array
        Unit, towards the sensor.
    landmark : (3,) array
        Says how pictures lie: at right angles to it, where it is not along the direction.
    cell, depth : float
        Lengths, positive.
    """
    cdef const double[:, ::1] given = checks.floats("points", points, "N", 3, finite=True)
    cdef const double[:, ::1] wanted = checks.floats("directions", directions, "D", 3, finite=True)
    cdef const double[::1] mark = checks.floats("landmark", landmark, 3, finite=True)
    cdef Py_ssize_t count = given.shape[0], i, d, behind
    cdef uint64_t mask = 1, at
    cdef vector[Pixel] table
    cdef vector[uint64_t] slot
    cdef vector[int64_t] across, along
    cdef vector[double] heights
    cdef int64_t least_across, least_along, most_along, key
    cdef double axes[9]
    cdef const double* x
    cdef Pixel none
    found = np.zeros(wanted.shape[0])
    cdef double[::1] share = found
    checks.positive(cell=cell)
    none.key, none.top = -1, 0
    while mask < <uint64_t> (2 * count):
        mask *= 2
    mask -= 1
    slot.resize(count)
    across.resize(count)
    along.resize(count)
    heights.resize(count)
    with nogil:
        for d in range(wanted.shape[0]):
            axes_across(&wanted[d, 0], &mark[0], axes)
            table.assign(mask + 1, none)
            for i in range(count):
                x = &given[i, 0]
                across[i] = <int64_t> floor((axes[0] * x[0] + axes[1] * x[1] + axes[2] * x[2])
                                            / cell)
                along[i] = <int64_t> floor((axes[3] * x[0] + axes[4] * x[1] + axes[5] * x[2])
                                           / cell)
                heights[i] = axes[6] * x[0] + axes[7] * x[1] + axes[8] * x[2]
                if i == 0:
                    least_across, least_along, most_along = across[0], along[0], along[0]
                least_across = min(least_across, across[i])
                least_along = min(least_along, along[i])
                most_along = max(most_along, along[i])
            for i in range(count):
                key = <int64_t> (
                    <uint64_t> (across[i] - least_across) * <uint64_t> (most_along - least_along + 1)
                    + <uint64_t> (along[i] - least_along) & <uint64_t> 0x7FFFFFFFFFFFFFFF
                )
                at = (<uint64_t> key * <uint64_t> 0x9E3779B97F4A7C15) >> 20 & mask
                while table[at].key >= 0 and table[at].key != key:
                    at = (at + 1) & mask
                if table[at].key < 0 or heights[i] > table[at].top:
                    table[at].key, table[at].top = key, heights[i]
                slot[i] = at
            behind = 0
            for i in range(count):
                if table[slot[i]].top - heights[i] > depth:
                    behind += 1
            share[d] = <double> behind / <double> count if count else 0
    return found


cdef void axes_across(const double* direction, const double* landmark, double* axes) noexcept nogil:
    """Rows: a unit vector at right angles to a direction and a landmark, another, the direction."""
    cdef double other[3]
    cdef double length
    cdef int k, least = 0
    cross(direction, landmark, axes)
    length = norm(axes)
    if not length > SHORT * norm(landmark):
        for k in range(1, 3):
            if fabs(direction[k]) < fabs(direction[least]):
                least = k
        for k in range(3):
            other[k] = 1.0 if k == least else 0.0
        cross(direction, other, axes)
        length = norm(axes)
    for k in range(3):
        axes[k] /= length
        axes[6 + k] = direction[k]
    cross(direction, axes, &axes[3])
