# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""The rays of a range image beside a point: what a sensor saw before, on or behind it."""

from libc.math cimport INFINITY, ceil, fabs, floor, fmax, fmin, sqrt
from libcpp.algorithm cimport sort
from libcpp.vector cimport vector

from mvreg.kernels.linear cimport cross, dot, norm, turn

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import checks

# Cells between a point and the rays that answer for it.
cdef enum:
    MOST_RINGS = 8
# Of vectors shorter than this times another the direction is lost in rounding.
cdef double SHORT = 1e-6
cdef double LEAST = 2.2250738585072014e-308
# Rays in a cell.
cdef double FILL = 2.0


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
            self.first[cell(self, &self.rays[i]) + 1] += 1
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
            sorted[filled[cell(self, &self.rays[i])]] = self.rays[i]
            filled[cell(self, &self.rays[i])] += 1
        self.rays.swap(sorted)

    cdef int ask(
        self, const double* x, int most, double reach, Ray* one, Ray* top, double* low
    ) noexcept nogil:
        """How many of the nearest rays, `reach` or less away, answer for a point.

        And the ray of the point itself, the highest of them, and the lowest height.
        """
        cdef double far[MOST_RAYS]
        cdef const Ray* kept[MOST_RAYS]
        cdef double least = fmin(self.reach, reach), gap = INFINITY, inside
        cdef Py_ssize_t at[2]
        cdef Py_ssize_t ring, i
        cdef int found = 0, axis, place
        least *= least
        self.project(x, one)
        for axis in range(2):
            if (one.x[axis] <= self.least[axis] - self.reach
                    or one.x[axis] >= self.most[axis] + self.reach):
                return 0
        for axis in range(2):
            at[axis] = place_of(self, one.x[axis], axis)
            inside = one.x[axis] - self.low[axis] - at[axis] * self.edge
            gap = fmin(gap, fmin(inside, self.edge - inside))
        gap = fmax(gap, 0) * (1 - 1e-9)
        for i in range(at[0] - 1, at[0] + 2):
            pick(self, i, at[1] - 1, at[1] + 1, one, most, far, kept, &found, &least)
        for ring in range(2, self.rings + 1):
            inside = (ring - 1) * self.edge + gap
            if inside * inside >= least:
                break
            for i in range(at[0] - ring + 1, at[0] + ring):
                pick(self, i, at[1] - ring, at[1] - ring, one, most, far, kept, &found, &least)
                pick(self, i, at[1] + ring, at[1] + ring, one, most, far, kept, &found, &least)
            i = at[0] - ring
            pick(self, i, at[1] - ring, at[1] + ring, one, most, far, kept, &found, &least)
            i = at[0] + ring
            pick(self, i, at[1] - ring, at[1] + ring, one, most, far, kept, &found, &least)
        low[0], top.height = INFINITY, -INFINITY
        for place in range(found):
            low[0] = fmin(low[0], kept[place].height)
            if kept[place].height > top.height:
                top[0] = kept[place][0]
        return found

    cdef double off_plane(
        self, const Ray* one, const Ray* other, const double* normal
    ) noexcept nogil:
        """How far what another ray met is off the plane of a point with a unit normal (length)."""
        cdef double across[3]
        cdef double gap[3]
        cdef int k
        turn(self.frame, normal, across)
        for k in range(3):
            if self.central:
                gap[k] = (one.height * one.x[k] - other.height * other.x[k]) / self.distance
            else:
                gap[k] = other.x[k] - one.x[k]
        if not self.central:
            gap[2] = other.height - one.height
        return fabs(dot(across, gap))

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
        cdef double least
        cdef Ray one, top
        with nogil:
            for i in range(count):
                if self.ask(&given[i, 0], most, self.reach, &one, &top, &least):
                    low[i], high[i] = least, top.height
                height[i] = one.height
        return own, lowest, highest


cdef inline Py_ssize_t place_of(Rays rays, double x, int axis) noexcept nogil:
    """The row or column; what is outside of the grid counts to its border."""
    cdef double at = (x - rays.low[axis]) / rays.edge
    return <Py_ssize_t> fmin(fmax(at, 0), rays.size[axis] - 1)


cdef inline Py_ssize_t cell(Rays rays, const Ray* ray) noexcept nogil:
    return place_of(rays, ray.x[0], 0) * rays.size[1] + place_of(rays, ray.x[1], 1)


cdef inline void pick(
    Rays rays, Py_ssize_t row, Py_ssize_t begin, Py_ssize_t end, const Ray* one, int most,
    double* far, const Ray** kept, int* found, double* least
) noexcept nogil:
    """Put the rays of some cells of a row among the nearest so far, nearest first."""
    cdef Py_ssize_t r
    cdef double a, b, c, d
    cdef int place
    cdef const Ray* ray
    if row < 0 or row >= rays.size[0]:
        return
    begin = begin if begin > 0 else 0
    end = end if end < rays.size[1] else rays.size[1] - 1
    if begin > end:
        return
    begin += row * rays.size[1]
    end += row * rays.size[1]
    for r in range(rays.first[begin], rays.first[end + 1]):
        ray = &rays.rays[r]
        a, b, c = ray.x[0] - one.x[0], ray.x[1] - one.x[1], ray.x[2] - one.x[2]
        d = a * a + b * b + c * c
        if not d < least[0]:
            continue
        place = found[0] if found[0] < most else most - 1
        while place > 0 and far[place - 1] > d:
            far[place], kept[place] = far[place - 1], kept[place - 1]
            place -= 1
        far[place], kept[place] = d, ray
        if found[0] < most:
            found[0] += 1
        if found[0] == most:
            least[0] = far[most - 1]


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
