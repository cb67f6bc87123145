"""Poses of scans as poses of cameras: COLMAP, nerfstudio.

A scan's frame is taken for the camera's: x to the right, y down, z ahead, as depth cameras have it.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np

from mvreg.export.placements import Component, Placements
from mvreg.export.poses.text import one_line, words
from mvreg.geometry import se3
from mvreg.report.run_folder import write_text

#: From the axes of OpenGL's cameras (x right, y up, z back) to those of OpenCV's.
OPENCV_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


def write_colmap(folder: Path, component: Component, placements: Placements) -> list[str]:
    """``colmap/images.txt``, and the two files without which COLMAP reads no images.

    ``IMAGE_ID qw qx qy qz tx ty tz CAMERA_ID NAME``, from the world to the camera; each is followed
    by an empty line, for the points seen.
    """
    folder = folder / "colmap"
    folder.mkdir(parents=True, exist_ok=True)
    lines, blanks = [], False
    for name, pose in component.poses.items():
        inverse = se3.invert(pose)
        x, y, z, w = se3.quaternion(inverse[:3, :3])
        word = re.sub(r"\s", "_", one_line(name))  # COLMAP reads names up to a blank
        blanks |= word != name
        image = placements.number(name) + 1
        lines.append(f"{image} {words([w, x, y, z, *inverse[:3, 3]])} 1 {word}\n\n")
    write_text(folder / "images.txt", "".join(lines))
    # A camera that images may refer to; nothing is known of it.
    write_text(folder / "cameras.txt", "1 PINHOLE 1 1 1 1 0.5 0.5\n")
    write_text(folder / "points3D.txt", "")
    return ["colmap/images.txt: blanks in names are written as _"] if blanks else []


def write_nerfstudio(folder: Path, component: Component, placements: Placements) -> list[str]:
    """``transforms.json``: from the camera to the world, with the axes of OpenGL's cameras."""
    frames = [
        {"file_path": name, "transform_matrix": (pose @ OPENCV_FROM_OPENGL).tolist()}
        for name, pose in component.poses.items()
    ]
    content = {"camera_model": "OPENCV", "frames": frames}
    write_text(folder / "transforms.json", json.dumps(content, indent=1) + "\n")
    return ["transforms.json has no intrinsics (fl_x, fl_y, cx, cy, w, h): add those of the camera"]
