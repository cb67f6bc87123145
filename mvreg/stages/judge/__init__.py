"""Decide whether a registration is reliable."""
