"""Propose matches by descriptor."""
