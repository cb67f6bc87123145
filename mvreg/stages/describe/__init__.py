"""Compute descriptors of keypoints."""
