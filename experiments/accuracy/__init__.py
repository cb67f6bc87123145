"""Accuracy of the poses, and of the ground truth itself."""
