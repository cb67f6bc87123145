"""Configurations: what Hydra is told, and the stages read back from it."""
