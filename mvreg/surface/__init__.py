"""Surfaces sampled by points: normals, spacing, contact, and what a sensor saw of them.

Public are the names below; the modules of this package may change.
"""

from typing import TYPE_CHECKING

from mvreg._lazy import looked_up

if TYPE_CHECKING:
    from mvreg.surface.fit import length_read_as_one as length_read_as_one
    from mvreg.surface.fit import localizability as localizability
    from mvreg.surface.fit import surface_fit as surface_fit
    from mvreg.surface.fit import underconstrained as underconstrained
    from mvreg.surface.normals import Orient as Orient
    from mvreg.surface.normals import estimate_normals as estimate_normals
    from mvreg.surface.normals import orient as orient
    from mvreg.surface.range_image import RangeImage as RangeImage
    from mvreg.surface.range_image import Sensor as Sensor
    from mvreg.surface.sensor_direction import estimated_direction as estimated_direction

_WHERE = {
    "Orient": "normals",
    "RangeImage": "range_image",
    "Sensor": "range_image",
    "estimate_normals": "normals",
    "estimated_direction": "sensor_direction",
    "length_read_as_one": "fit",
    "underconstrained": "fit",
    "orient": "normals",
    "localizability": "fit",
    "surface_fit": "fit",
}

__all__ = sorted(_WHERE)
__getattr__, __dir__ = looked_up(__name__, _WHERE)
