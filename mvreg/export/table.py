"""Every format that a run can be exported to."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from functools import cache

from mvreg.errors import InputError
from mvreg.export import points
from mvreg.export.brought import collect_exports
from mvreg.export.e57_poses import write_e57_poses
from mvreg.export.formats import Format, PointFormat, PoseFormat
from mvreg.export.poses import cameras, matrices, posegraph, trajectories
from mvreg.export.ptx import write_ptx
from mvreg.io.e57_write import require_pye57
from mvreg.plugins import manager

#: In the order in which they are listed.
FORMATS: tuple[Format, ...] = (
    PoseFormat("matrix", "matrix/NAME.txt", "4x4 matrix of each scan", matrices.write_matrix),
    PoseFormat("matrices", "matrices.txt", "all 4x4 matrices in one text, with names",
               matrices.write_matrices, matrices.read_matrices),
    PoseFormat("cloudcompare", "cloudcompare/NAME.txt", "matrices for CloudCompare's -APPLY_TRANS",
               matrices.write_cloudcompare),
    PoseFormat("meshlab", "meshlab.aln", "MeshLab's alignment of several scans",
               matrices.write_meshlab),
    PoseFormat("tum", "tum.txt", "TUM's RGB-D benchmark", trajectories.write_tum,
               trajectories.read_tum),
    PoseFormat("kitti", "kitti.txt", "KITTI's odometry", trajectories.write_kitti),
    PoseFormat("redwood", "redwood.log", "trajectory of Redwood and Open3D",
               trajectories.write_redwood),
    PoseFormat("posegraph", "posegraph.json", "Open3D's pose graph, links as edges",
               posegraph.write_posegraph),
    PoseFormat("colmap", "colmap/images.txt", "COLMAP's text model, scans as images",
               cameras.write_colmap),
    PoseFormat("nerfstudio", "transforms.json", "nerfstudio's, scans as images",
               cameras.write_nerfstudio),
    PointFormat("ply", "model.ply", "merged model, doubles, all attributes",
                points.write_ply_model, residuals=True),
    PointFormat("pcd", "model.pcd", "merged model, for PCL", points.write_pcd_model,
                residuals=True),
    PointFormat("las", "model.las", "merged model, LAS 1.4", points.write_las_model,
                residuals=True),
    PointFormat("laz", "model.laz", "the same, compressed", points.write_laz_model,
                residuals=True),
    PointFormat("e57", "model.e57", "all scans in one file, with poses; needs mvreg[e57]",
                points.write_e57_model, require_pye57),
    PointFormat("e57_poses", "e57_poses/*.e57", "copies of the E57 files that came, poses changed",
                write_e57_poses),
    PointFormat("ptx", "ptx/NAME.ptx", "each scan in its own frame, pose in the header",
                write_ptx),
    PointFormat("scans", "scans/NAME.*", "each scan moved, in the format of its file or PLY",
                points.write_scans, residuals=True),
)  # fmt: skip
#: By name; the second name of one.
BY_NAME: dict[str, Format] = {each.name: each for each in FORMATS}
BY_NAME["4x4"] = BY_NAME["matrices"]


@cache
def formats() -> dict[str, Format]:
    """Every format by name, those of plugins last.

    Raises
    ------
    PluginError
        If a plugin is broken, or what it returns are no formats.
    """
    return BY_NAME | collect_exports(manager.current(), BY_NAME)


def formats_of(names: Iterable[str]) -> list[Format]:
    """The formats of some names, none twice.

    Raises
    ------
    InputError
        For a name that there is not; lists those that there are. If a format needs what is not
        installed.
    """
    found: dict[str, Format] = {}
    for name in names:
        each = formats().get(str(name).lower())
        if each is None:
            near = get_close_matches(str(name).lower(), formats(), n=1)
            hint = f"did you mean {near[0]}? " if near else ""
            raise InputError(
                f"export: there is no format {str(name)!r}; {hint}formats: {', '.join(formats())}"
            )
        if isinstance(each, PointFormat) and each.require is not None:
            each.require()
        found[each.name] = each
    return list(found.values())


def listing() -> str:
    """A table of the formats as text."""
    every = {each.name: each for each in formats().values()}.values()
    widths = [max(len(getattr(each, key)) for each in every) for key in ("name", "files")]
    return "".join(
        f"  {each.name:<{widths[0]}}  {each.files:<{widths[1]}}  {each.summary}\n" for each in every
    )
