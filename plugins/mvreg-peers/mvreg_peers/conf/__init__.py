"""The presets: `method/open3d_multiway.yaml` and `method/kiss_gicp.yaml`."""
