"""The colours of scans and of grades."""

from __future__ import annotations

import colorsys

#: Of grades, dark enough for white text on them.
GRADE_COLOURS = {"green": "#1a7f37", "amber": "#9a6700", "red": "#c2281d", "none": "#6b7280"}
#: Of a scan that none is known of.
GREY = "#888888"


def colour(number: int) -> str:
    """A colour for the scan of this number, far from those before it: ``#rrggbb``."""
    hue = (0.58 + number * 0.61803398875) % 1.0
    light = 0.46 if number % 2 else 0.58
    red, green, blue = colorsys.hls_to_rgb(hue, light, 0.62)
    return "#" + "".join(f"{round(255 * part):02x}" for part in (red, green, blue))
