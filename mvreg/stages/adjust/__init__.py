"""Improve all the poses at once."""
