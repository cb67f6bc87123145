"""Plugins: hooks, the manager that finds them, and the table of stages."""
