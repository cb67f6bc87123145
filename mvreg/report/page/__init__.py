"""The page of a run: one HTML file that a person judges a registration by."""
