"""Make a coarse pose accurate."""
