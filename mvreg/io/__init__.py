"""Files in, files out: scans, poses, and PLY."""

from mvreg.io.cloud import PointCloud
from mvreg.io.ply_write import write_ply
from mvreg.io.points import READERS, SUPPORTED, read_cloud, read_points
from mvreg.io.poses import read_poses

__all__ = [
    "READERS",
    "SUPPORTED",
    "PointCloud",
    "read_cloud",
    "read_points",
    "read_poses",
    "write_ply",
]
