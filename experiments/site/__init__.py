"""The figures of the documentation, each from runs made on the spot."""
