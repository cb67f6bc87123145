"""Choose which pairs to register, in which order."""
