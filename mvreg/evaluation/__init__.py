"""The quality of poses: errors against ground truth, and confidence without it."""
