# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
# cython: initializedcheck=False
# distutils: language = c++
"""What the points of one scan show on the surface of another, and before what its sensor saw.

A view pair of two scans is one pass over the points of each, and leaves sums: about a centre that
is near, so that nothing cancels however far away the scans' frames begin. From these follows
whatever is asked of the points together, in any frame.
"""

from libc.math cimport INFINITY, fabs, sqrt
from libc.string cimport memcpy, memset

from mvreg.kernels.linear cimport (
    Motion, cross, dot, move, of_array, plane_height, turn, turn_back,
)
from mvreg.kernels.rays cimport MOST_RAYS, Ray, Rays, check_rays
from mvreg.kernels.tree cimport Tree, node_distance

import numpy as np

from mvreg.errors import RecordError
from mvreg.kernels import checks
from mvreg.kernels.results import Sight

# Sums over the points that meet; see `Sight`.
cdef struct Sums:
    double squared
    double first[3]
    double second
    double mixed[6][6]
    double plain[6][6]
    double pushed[6]


def directed_evidence(
    Tree tree not None, planes, points, normals, centre, double radius, transform, double reach,
    double least_cosine, bint oriented, Rays rays, int most_rays, double tolerance, double edge
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
        So far before the surface about its ray a point is still on it (length); and farther, if
        that surface goes on in the point's own plane, as ground between two rings of a LiDAR does.

    edge : float
        No point floats that is on what a ray met so near its own (length): beside the edge of what
        stands in front the few rays of a dense scan may all pass by.

    Returns
    -------
    Sight
    """
    cdef const double[:, ::1] given = checks.floats("points", points, "P", 3)
    cdef const double[:, ::1] own = checks.floats("normals", normals, given.shape[0], 3)
    cdef const double[:, ::1] other = checks.floats("planes", planes, tree.n, 3)
    cdef const double[::1] middle = checks.floats("centre", centre, 3)
    cdef Py_ssize_t count = given.shape[0], near = 0, consistent = 0, front = 0, i, partner
    cdef bint surface, seen, floats
    cdef double x[3]
    cdef double turned[3]
    cdef double squared, low
    cdef Ray one, top
    cdef Motion motion
    of_array(checks.transform("transform", transform), motion)
    check_rays(most_rays)
    flags = np.zeros(count, dtype=np.uint8)
    cdef unsigned char[::1] met = flags
    cdef Sums sums
    memset(&sums, 0, sizeof(Sums))
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
                            &sums, motion, x, &given[i, 0], &middle[0], &own[i, 0],
                            &other[partner, 0], &tree.cloud[partner, 0], least_cosine, oriented,
                        )
                if seen and rays.ask(x, most_rays, INFINITY, &one, &top, &low):
                    turn(motion, &own[i, 0], turned)
                    floats = floating(rays, &one, &top, turned, tolerance)
                    if floats and rays.ask(x, MOST_RAYS, edge, &one, &top, &low):
                        floats = floating(rays, &one, &top, turned, tolerance)
                    if floats:
                        front += 1
                    elif not one.height < low - tolerance:
                        consistent += 1
    return Sight(
        flags.view(np.bool_), near, consistent, front, sums.squared, as_array(sums.first, 3),
        sums.second, as_array(&sums.mixed[0][0], 36).reshape(6, 6),
        as_array(&sums.plain[0][0], 36).reshape(6, 6), as_array(sums.pushed, 6))


cdef inline bint floating(
    Rays rays, const Ray* one, const Ray* top, const double* normal, double tolerance
) noexcept nogil:
    """Whether a point is before what its rays met, which is not in its own plane."""
    return one.height > top.height + tolerance and (
        rays.off_plane(one, top, normal) > tolerance)


cdef as_array(const double* values, Py_ssize_t size):
    found = np.empty(size)
    cdef double[::1] view = found
    memcpy(&view[0], values, size * sizeof(double))
    return found


cdef bint add(
    Sums* total, const double* motion, const double* x, const double* point,
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
    cosine = dot(turned, plane)
    if not (cosine if oriented else fabs(cosine)) > least_cosine:
        return False
    height = plane_height(x, partner, plane)
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
    total.squared += height * height
    for k in range(3):
        total.first[k] += p[k]
    total.second += dot(p, p)
    for j in range(6):
        for k in range(6):
            total.mixed[j][k] += first[j] * second[k]
            total.plain[j][k] += second[j] * second[k]
        total.pushed[j] += height * second[j]
    return True


def which_may_overlap(
    centre, double radius, Rays rays, double reach, centres, radii, list others, reaches, transforms
):
    """Of which still scans `directed_evidence` could find anything, either way; True if in doubt.

    Parameters
    ----------
    centre, radius, rays, reach
        Of the scan that moves: a ball around its points, what its sensor saw, and how far points
        may be from it (length).
    centres, radii, others, reaches
        Of the still scans: (M, 3) and (M,) arrays, a list of their rays or None, an (M,) array; of
        two reaches the larger counts.
    transforms : (M, 4, 4) array
        ``T_still_moving`` of each.

    Returns
    -------
    (M,) array of bool
    """
    cdef const double[:, ::1] middles = checks.floats("centres", centres, "M", 3)
    cdef Py_ssize_t count = middles.shape[0], i
    cdef const double[::1] own = checks.floats("centre", centre, 3)
    cdef const double[::1] sizes = checks.floats("radii", radii, count)
    cdef const double[::1] ranges = checks.floats("reaches", reaches, count)
    cdef const double[:, :, ::1] poses = checks.floats("transforms", transforms, count, 4, 4)
    cdef Rays seen
    cdef double x[3]
    cdef double y[3]
    cdef double gap
    cdef int k
    cdef Motion motion
    if len(others) != count:
        raise RecordError(f"others: expected {count} rays, got {len(others)}")
    answer = np.zeros(count, dtype=bool)
    cdef unsigned char[::1] found = answer.view(np.uint8)
    for i in range(count):
        of_array(poses[i], motion)
        move(motion, &own[0], x)
        gap = 0
        for k in range(3):
            y[k] = middles[i, k] - motion[9 + k]
            gap += (x[k] - middles[i, k]) * (x[k] - middles[i, k])
        if sqrt(gap) <= (radius + sizes[i]) * (1 + 1e-9) + max(reach, ranges[i]):
            found[i] = True
            continue
        seen = others[i]
        if seen is not None and seen.beside(x, radius):
            found[i] = True
            continue
        turn_back(motion, y, x)
        found[i] = rays is not None and rays.beside(x, sizes[i])
    return answer
