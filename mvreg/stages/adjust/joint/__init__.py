"""Joint refinement: all poses at once, surface to surface."""
