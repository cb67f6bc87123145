"""Merge a scan into the model."""
