"""What the compiled kernels compute, in plain NumPy and SciPy: slow, short, and easy to check.

Nothing but tests and benchmarks uses it.
"""
