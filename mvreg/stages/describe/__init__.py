"""Give keypoints descriptors."""
