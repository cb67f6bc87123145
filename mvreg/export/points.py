"""Points in the frame of the model: merged in one file, or each scan in a file of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path, PurePath

from mvreg.export.model import Clouds, Model
from mvreg.export.poses.text import stems


def _ply(path: Path, clouds: Clouds) -> list[str]:
    from mvreg.io import write_ply_clouds

    write_ply_clouds(path, clouds, clouds.kinds)
    return []


def _pcd(path: Path, clouds: Clouds) -> list[str]:
    from mvreg.io.pcd_write import write_pcd_clouds

    return write_pcd_clouds(path, clouds, clouds.kinds)


def _las(path: Path, clouds: Clouds) -> list[str]:
    from mvreg.io.las_write import write_las_clouds

    return write_las_clouds(path, clouds, clouds.kinds, clouds.probes)


def _e57(path: Path, clouds: Clouds) -> list[str]:
    from mvreg.io.e57_write import write_e57_scans

    write_e57_scans(path, [clouds])
    return []


#: Writers of one cloud, by suffix. None needs all points of a scan in memory.
WRITERS: dict[str, Callable[[Path, Clouds], list[str]]] = {
    ".ply": _ply, ".pcd": _pcd, ".las": _las, ".laz": _las, ".e57": _e57,
}  # fmt: skip


def _merged(suffix: str) -> Callable[[Path, Model], list[str]]:
    def write(folder: Path, model: Model) -> list[str]:
        clouds = Clouds(model.placed)
        return WRITERS[suffix](folder / f"model{suffix}", clouds) + model.filled()

    return write


write_ply_model = _merged(".ply")
write_pcd_model = _merged(".pcd")
write_las_model = _merged(".las")
write_laz_model = _merged(".laz")


def write_e57_model(folder: Path, model: Model) -> list[str]:
    """``model.e57``: every scan by itself, in the frame of its file, with its pose."""
    from mvreg.io.e57_write import write_e57_scans

    write_e57_scans(folder / "model.e57", model.scans())
    return []


def write_scans(folder: Path, model: Model) -> list[str]:
    """``scans/``: each scan moved by its pose, in the format of its file, or else as PLY."""
    names = stems(model.placements)
    remarks: list[str] = []
    for one in model.placed:
        suffix = PurePath(one.scan.name).suffix.lower()
        suffix = suffix if suffix in WRITERS else ".ply"
        path = folder / "scans" / f"{names[one.scan.name]}{suffix}"
        remarks += WRITERS[suffix](path, Clouds([one], indexed=False))
    return remarks
