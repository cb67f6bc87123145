"""Green, amber or red: the grade of a placed scan.

The quantities are those that commercial packages report of a registration: overlap, residual, and
the "strength" of an overlap along each axis (Leica Cyclone REGISTER 360, "Error Reporting"); these
packages colour them green, amber and red. The limits are this module's own, and all stand here.
"""

from __future__ import annotations

from enum import Enum


class Grade(Enum):
    """The grade of a pose."""

    green = "green"
    amber = "amber"
    red = "red"


#: A pose is green only if at most one in twenty of its like is wrong, as the confidence says.
GREEN_CONFIDENCE = 0.95
#: A pose that is rather wrong than right is red.
AMBER_CONFIDENCE = 0.5
# The other limits are set by the Bunny, Dragon and Buddha scans at their true poses, and with one
# scan turned about its middle by 0.5, 1, 2 and 4 degrees.
#: Half of the least overlap there, that of the Bunny's chin (0.68; the others have 0.98 and more).
GREEN_COVERAGE = 0.34
#: Right poses have at least 0.82, those that are off by one degree at most 0.82, half of them less
#: than 0.79, 0.68 and 0.49; see `mvreg.evaluation.assess.TOLERANCE`.
GREEN_INLIER_RATIO = 0.8
#: Right poses have at least 0.26 along every axis; a scan that shares a plane has 0.
GREEN_STRENGTH = 0.1


def grade(
    confidence: float | None, coverage: float, inlier_ratio: float | None, strength: float
) -> Grade:
    """Grade a placed scan; `strength` is that of the axis along which it is held least.

    Red says that the pose is probably wrong, or that there is no evidence for it. Amber says: look
    at it. A pose is then likely right, but little holds it.
    """
    if confidence is None or inlier_ratio is None or confidence < AMBER_CONFIDENCE:
        return Grade.red
    good = (
        confidence >= GREEN_CONFIDENCE
        and coverage >= GREEN_COVERAGE
        and inlier_ratio >= GREEN_INLIER_RATIO
        and strength >= GREEN_STRENGTH
    )
    return Grade.green if good else Grade.amber
