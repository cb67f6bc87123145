"""What the gnome carries, and what it stands on."""

from __future__ import annotations

import numpy as np

from mvreg.datasets.relief import bumps, ridges, turned
from mvreg.datasets.sdf import Array, Part, block, ellipsoid, limb, torus


def props() -> list[Part]:
    """The parts, in the order in which they are joined."""
    return [*_ground(), *_mushrooms(), *_snail(), *_pack(), *_lantern(), *_staff()]


def _ground() -> list[Part]:
    rock, moss = bumps(19, 1.7, 1), bumps(6.5, 0.5, 2)

    def rough(points: Array) -> Array:
        return rock(points) + moss(points)

    grain = ridges((0.1, 1, 1.2), 3.6, 0.4, 2.5)
    return [
        ellipsoid((0, 3, 6), (45, 38, 9.5), relief=rough),
        ellipsoid((-27, -20, 7), (14, 11, 8.5), turned(30), rough, blend=4),
        ellipsoid((31, -16, 8), (11, 13, 8), turned(-20, 10), bumps(9, 1.4, 3), blend=2),
        ellipsoid((36, 8, 8), (7, 9, 9), turned(40), bumps(8, 1.2, 4), blend=2),
        ellipsoid((3, -31, 6), (10, 7, 6), turned(10), bumps(7, 1.0, 5), blend=2),
        limb([(-44, 14, 12), (-20, 30, 16), (8, 38, 14)], [6.5, 7.5, 7], grain, blend=1.5, steps=3),
        limb([(-26, 27, 19), (-28, 31, 28), (-34, 33, 33)], [3.2, 2.4, 1.8], grain, blend=2),
        ellipsoid((-46, 13, 12), (3, 4.6, 4.6), turned(33), carve=True),
    ]


def _mushrooms() -> list[Part]:
    parts = [
        ellipsoid((-31, -24, 34), (12, 12, 9.5), turned(0, 12, 14)),
        ellipsoid((-30, -23, 29), (13, 13, 5), turned(0, 12, 14), carve=True),
        limb([(-31, -22, 10), (-33, -23, 24), (-31, -24, 37)], [4.4, 3.2, 3.0], blend=2, steps=3),
        ellipsoid((-17, -34, 22), (7.5, 7.5, 6), turned(0, -15, 15)),
        ellipsoid((-17.5, -34, 18.5), (8, 8, 3), turned(0, -15, 15), carve=True),
        limb([(-20, -30, 8), (-17, -33, 17), (-17, -34, 24)], [3, 2.2, 2.0], blend=2),
    ]
    spots = ((-37, -31, 39.5, 2.0), (-26, -33, 39.5, 1.5), (-23, -26, 41, 1.9), (-31, -27, 43, 2.6),
             (-36, -20, 43, 1.6), (-19, -38, 25.5, 1.5), (-14, -33, 28, 1.7))  # fmt: skip
    for x, y, z, size in spots:
        parts.append(ellipsoid((x, y, z), (size, size, size), blend=0.6))
    return parts


def _snail() -> list[Part]:
    angle = np.linspace(0.2, 5.2 * np.pi, 34)
    arm = 0.4 + 0.5 * angle
    shell = np.column_stack(
        [32 + 0.25 * arm * np.sin(angle), 27 + arm * np.cos(angle), 24 + arm * np.sin(angle)]
    )
    shell[:, 0] += 3 * (1 - angle / angle[-1])
    return [
        limb([(27, 42, 11), (31, 33, 13), (33, 22, 14), (33, 15, 18)], [1.5, 3.6, 3.6, 2.8],
             blend=3, steps=3),
        limb(shell.tolist(), (0.9 + 0.19 * angle).tolist()),
        limb([(34, 14, 19), (36.5, 11.5, 25)], [1.1, 0.9], blend=1),
        limb([(32, 14, 19), (30, 10.5, 24)], [1.1, 0.9], blend=1),
    ]  # fmt: skip


def _pack() -> list[Part]:
    weave, roll = ridges((1, 0.2, 0.6), 3.4, 0.35, 1.0), ridges((0.2, 1, 0.4), 9, 0.9, 2.0)
    tilt = turned(7, 0, 9)
    return [
        block((2, 27, 66), (16, 9, 17), 5, tilt, bumps(12, 1.1, 21), blend=1),
        block((2, 31, 75), (16.5, 8, 8), 3, tilt, weave, blend=0.3),
        block((6, 39, 68), (2.2, 1.6, 5), 1, tilt),
        block((-14, 31, 60), (5, 6, 8), 2.5, turned(25, 0, 5), bumps(6, 0.6, 22), blend=0.5),
        limb([(-19, 27, 89), (3, 30, 91), (25, 33, 89)], [7, 7.5, 7], roll, blend=0.5, steps=2),
        torus((-9, 29, 90), (8.3, 8.3), (1.2, 2.0), turned(9, 90)),
        torus((15, 31.5, 90), (8.3, 8.3), (1.2, 2.0), turned(9, 90)),
        torus((25.5, 33, 89), (3.8, 3.8), (1.0, 1.0), turned(9, 90)),
        ellipsoid((19, 33, 62), (7.5, 5.5, 7.5), turned(-30, 0, 15), blend=0.3),
        torus((19.8, 35, 70), (3.2, 3.2), (1.5, 1.5), turned(-30, 0, 15)),
        limb([(-11, 20, 82), (-13, 8, 84), (-13, -8, 78), (-13, -16, 70), (-17, -14, 60)],
             [2.2, 2.2, 2.4, 2.2, 2.0], blend=0.6, steps=3),
        limb([(12, 20, 82), (14, 8, 84), (14, -8, 78), (15, -15, 69), (19, -12, 60)],
             [2.2, 2.2, 2.4, 2.2, 2.0], blend=0.6, steps=3),
    ]  # fmt: skip


def _lantern() -> list[Part]:
    x, y = -37.5, -32.0
    parts = [
        torus((x, y, 90), (5.5, 5.5), (1.2, 1.2), turned(60, 90)),
        limb([(x, y, 86), (x, y, 82), (x, y, 79)], [1.5, 3.5, 8.2], ridges((0, 0, 1), 3, 0.3)),
        ellipsoid((x, y, 70), (6.2, 6.2, 9), turned(0, 5)),
        torus((x, y, 61.5), (6.0, 6.0), (2.4, 2.0)),
        ellipsoid((x, y, 60.5), (6, 6, 2.5)),
    ]
    for degrees in (10, 75, 150, 220, 290):
        angle = np.radians(degrees)
        dx, dy = 7 * np.cos(angle), 7 * np.sin(angle)
        parts.append(limb([(x + dx, y + dy, 61), (x + dx, y + dy, 79)], [1.2, 1.2], blend=0.5))
    return parts


def _staff() -> list[Part]:
    grain = ridges((1, 0.4, 0.5), 3.2, 0.3, 2.0)
    return [
        limb([(33, -30, 8), (36, -30, 35), (34, -30.5, 58), (37, -30, 80), (35, -29, 98)],
             [2.6, 2.9, 2.6, 3.0, 3.4], grain, steps=3),
        limb([(35, -29, 98), (41, -28, 106), (39, -27, 115), (31, -28, 115), (31, -29, 108)],
             [3.4, 3.0, 2.6, 2.2, 1.6], grain, blend=1, steps=4),
        limb([(36.5, -30, 82), (42, -33, 88), (42, -35, 92)], [2.0, 1.5, 1.2], blend=1.5),
        ellipsoid((36, -30, 33), (4, 4, 3), relief=bumps(4, 0.6, 31), blend=1.5),
    ]  # fmt: skip
