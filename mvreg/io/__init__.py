"""Files in, files out: scans, poses, and PLY."""

from mvreg.io.cloud import PointCloud
from mvreg.io.formats import FORMATS, Format, ReadOptions
from mvreg.io.pieces import NotInPiecesError, Pieces
from mvreg.io.ply_write import write_ply, write_ply_clouds
from mvreg.io.points import (
    READERS,
    SUPPORTED,
    iterate_clouds,
    open_pieces,
    read_cloud,
    read_clouds,
    read_points,
    whole_scan,
)
from mvreg.io.poses import read_poses

__all__ = [
    "FORMATS",
    "READERS",
    "SUPPORTED",
    "Format",
    "NotInPiecesError",
    "Pieces",
    "PointCloud",
    "ReadOptions",
    "iterate_clouds",
    "open_pieces",
    "read_cloud",
    "read_clouds",
    "read_points",
    "read_poses",
    "whole_scan",
    "write_ply",
    "write_ply_clouds",
]
