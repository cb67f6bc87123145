"""Benchmarks of single functions beside their references, by pytest-benchmark."""
