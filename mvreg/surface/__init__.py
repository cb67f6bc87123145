"""Surfaces sampled by points: normals, spacing, overlap, and what a sensor saw of them."""
