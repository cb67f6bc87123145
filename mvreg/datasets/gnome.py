"""The figurine: a gnome with a lantern, a staff and a pack, 150 mm tall, modelled in code.

It faces -y; the ground is about z = 15, the lowest stone z = -5; lengths are in mm. No two sides
are alike, and there is relief from the folds of the coat (10 mm) down to wood grain and knitting
(3 mm), so that a descriptor of any radius from 5 to 20 mm finds something to hold on to.
"""

from __future__ import annotations

from mvreg.datasets.gnome_props import props
from mvreg.datasets.relief import bumps, folds, ridges, turned
from mvreg.datasets.sdf import Array, Part, block, ellipsoid, limb, torus


def gnome() -> list[Part]:
    """The parts, in the order in which they are joined; the coat is first, for it is cut."""
    return [*_coat(), *props(), *_legs(), *_arms(), *_head(), *_beard(), *_hat()]


def _coat() -> list[Part]:
    hang, cloth = folds((0, 2), 7, 2.0, 32, 66, 11), bumps(11, 0.5, 12)

    def drape(points: Array) -> Array:
        return hang(points) + cloth(points)

    buckle = turned(-6, 0, -8)
    return [
        limb([(0, 2, 37), (0, 2, 52), (0, 3, 66), (1, 3, 80)], [24, 24.5, 21, 14], drape, 2, 2),
        block((0, 2, 21), (40, 40, 13), 1, relief=folds((0, 2), 5, 1.6, 30, 60, 13), carve=True),
        limb([(0, -20, 66), (-3, -26, 50), (-6, -27, 36)], [1.4, 1.6, 1.5], blend=1.5, steps=3),
        torus((0, 2, 52), (25, 25.5), (2.0, 3.4), turned(0, -4, 3)),
        block((-3, -25, 52.5), (5.4, 2.2, 5.2), 1.2, buckle),
        block((-3, -27.5, 52.5), (3, 2.2, 2.8), 0.8, buckle, carve=True),
        block((19, -19, 45), (7.5, 5, 7), 2.5, turned(42, 0, 6), bumps(7, 0.5, 14)),
        limb([(13, -25.5, 48), (19, -23, 45), (25, -16.5, 48)], [1.3, 2.2, 1.3], blend=1, steps=2),
        limb([(-19, -19, 50), (-22, -20, 42), (-21, -21, 35)], [2.2, 2.6, 2.2], blend=0.5),
        ellipsoid((1.5, -21.5, 60), (2, 1.6, 2), blend=0.5),
    ]


def _legs() -> list[Part]:
    crease = ridges((0, 0.3, 1), 4.5, 0.45, 1.5)
    return [
        limb([(-10, 0, 42), (-12, -4, 30), (-12, -7, 22)], [10, 8.5, 7.5], crease, steps=2),
        limb([(10, 2, 42), (13, 3, 30), (14, 2, 22)], [10, 8.5, 7.5], crease, steps=2),
        limb([(-12, -6, 24), (-12, -9, 17)], [7, 6], blend=1),
        limb([(-12, -8, 17), (-13, -17, 16.5), (-14, -25, 18), (-13, -29, 23), (-11, -27, 27)],
             [6.5, 6.5, 5, 3, 1.5], blend=2, steps=3),
        torus((-12, -7, 25), (7, 7), (1.9, 2.2), turned(0, 0, 15)),
        limb([(14, 2, 24), (15, 0, 17)], [7, 6], blend=1),
        limb([(15, 1, 17), (19, -7, 16.5), (23, -14, 18), (24, -18, 22.5), (23, -17, 26)],
             [6.5, 6.5, 5, 3, 1.5], blend=2, steps=3),
        torus((14, 2, 25), (7, 7), (1.9, 2.2), turned(0, 0, -5)),
    ]  # fmt: skip


def _arms() -> list[Part]:
    crease = ridges((0.9, 0, 0.5), 5.0, 0.5, 2.0)
    parts = [
        limb([(-12, 2, 76), (-25, -3, 72), (-31, -14, 80), (-34, -21, 90)], [9, 8, 7.2, 7.5],
             crease, blend=3, steps=3),
        torus((-34.3, -22, 91.5), (7, 7), (2, 2.2), turned(20, 0, 38)),
        limb([(-34, -21, 90), (-36, -25, 98)], [4.2, 5.0]),
        limb([(12, 2, 76), (25, 0, 66), (31, -9, 56), (33, -19, 58)], [9, 8.2, 7.4, 7.2],
             crease, blend=3, steps=3),
        torus((33, -19.5, 58), (7, 7), (2, 2.2), turned(8, 0, 80)),
        limb([(33, -19, 58), (34, -27, 60)], [4.2, 5.0]),
    ]  # fmt: skip
    for lift in (0.0, 3.1, 6.2):
        right = [(-39, -24, 95.5), (-37, -30.5, 96), (-32.5, -28, 95.5)]
        left = [(31, -27, 57), (32.5, -34, 57), (38, -33, 57.2), (38.5, -29, 57.5)]
        for finger in (right, left):
            path = [(x, y, z + lift) for x, y, z in finger]
            parts.append(limb(path, [1.8] * (len(path) - 1) + [1.5], blend=0.6, steps=2))
    parts.append(limb([(-33, -23, 97), (-31.5, -26, 101), (-34, -29, 103)], [2, 1.9, 1.7], blend=1))
    return parts


def _head() -> list[Part]:
    return [
        ellipsoid((0, -4, 90), (15, 14, 15), blend=3),
        ellipsoid((-8, -14, 88), (5.5, 4.5, 4.5), blend=2),
        ellipsoid((8.5, -14, 88.5), (5.5, 4.5, 4.5), blend=2),
        ellipsoid((0.8, -20.5, 90), (4.6, 5.6, 4.4), turned(5), blend=1),
        ellipsoid((-6, -16.5, 95.5), (2.6, 2.2, 2.6)),
        ellipsoid((6.5, -16.5, 95.8), (2.6, 2.2, 2.6)),
        limb([(-11, -14.5, 98), (-7.5, -18, 101), (-3, -18, 100.5)], [1.4, 2.0, 1.4], blend=0.8,
             steps=2),
        limb([(11.5, -14, 99.5), (8, -18, 102.5), (3, -18, 102.5)], [1.4, 2.0, 1.4], blend=0.8,
             steps=2),
        ellipsoid((-16.5, -3, 91), (3, 5, 7), turned(-20, 12), blend=1),
        ellipsoid((-18.5, -5.5, 91), (2, 2.6, 4), turned(-20, 12), blend=0.6, carve=True),
        ellipsoid((17, -2, 91), (3, 5, 7), turned(25, -14), blend=1),
        ellipsoid((19, -4.5, 91), (2, 2.6, 4), turned(25, -14), blend=0.6, carve=True),
    ]  # fmt: skip


def _beard() -> list[Part]:
    strands = ridges((1, 0, 0.15), 3.0, 0.45, 2.5)
    parts = [limb([(0, -13, 84), (2, -19, 75), (4, -22, 64)], [11, 10, 5], strands, 2, 3)]
    locks = (
        ((-11, -12, 86), (-12, -17, 76), (-6, -23, 66), (-8, -26, 58)),
        ((-6, -16, 82), (-5, -23, 72), (0, -26, 62), (-2, -28, 55)),
        ((0, -17, 82), (2, -25, 72), (5, -27, 60), (2, -29, 50)),
        ((6, -16, 82), (8, -22, 73), (10, -25, 63), (7, -27, 56)),
        ((12, -11, 87), (14, -16, 78), (13, -21, 68), (16, -24, 61)),
    )
    for lock in locks:
        parts.append(limb(lock, [3.6, 4.2, 3.6, 0.8], strands, 0.8, 3))
    curls = (
        ((1, -21, 86), (-5, -22, 84), (-11, -20, 83), (-15, -18, 87), (-13.5, -18, 90)),
        ((1, -21, 86), (7, -22, 84), (12, -20, 81), (17, -17, 82), (18, -16, 86)),
    )
    for curl in curls:
        parts.append(limb(curl, [2.2, 3.4, 2.8, 1.7, 1.0], strands, 0.6, 3))
    return parts


def _hat() -> list[Part]:
    felt, knit = bumps(10, 0.6, 41), ridges((0.3, 0.2, 1), 4.4, 0.3, 1.2)

    def relief(points: Array) -> Array:
        return felt(points) + knit(points)

    lean, plume = turned(20, 4, -6), turned(10, -24, -14)
    return [
        limb([(0, -2, 106), (-1, -1, 116), (0, 1, 127), (5, 4, 138), (14, 6, 144), (22, 4, 141),
              (25, 1, 133)], [15.5, 12.5, 9.5, 7, 5, 3.6, 2.5], relief, 0, 3),
        torus((0, -2, 106), (17.5, 16.5), (3.0, 2.2), lean, bumps(13, 0.9, 42), 0.5),
        torus((-0.5, -1.5, 111), (14.6, 14.1), (1.5, 2.6), lean),
        block((-9, -13.5, 112), (3.8, 1.6, 4), 1, turned(-34, 0, -15)),
        block((-10, -15, 112), (1.9, 1.8, 2), 0.6, turned(-34, 0, -15), carve=True),
        ellipsoid((25, 0, 129), (5.5, 5.5, 5.5), relief=bumps(3.6, 0.6, 43)),
        ellipsoid((-19, -1, 127), (1.7, 5.2, 16), plume, ridges((0, 1, -0.8), 2.8, 0.35), 0.3),
        limb([(-13, -4, 112), (-19, -2, 126), (-27, 4, 143)], [1.2, 1.6, 0.9], blend=0.4, steps=2),
        block((-8.5, 9, 120), (5, 2.4, 5.5), 1, turned(40, 0, 22), bumps(5, 0.4, 44), 0.3),
    ]  # fmt: skip
