"""Compiled kernels: the loops that take the time, and nothing else.

Each module here is Cython, built by pip, and has one plain NumPy reference in
`mvreg.testing.reference` that tests compare it with. Kernels know arrays, not scans or stages. They
release Python's lock, so that `mvreg.parallel.in_threads` keeps all cores busy; of themselves they
start no thread, but for the helper of `mvreg.kernels.trimmed_pairs`, which looks at every point by
itself: an answer cannot depend on how many there are. They are compiled for any machine of their
kind and without shortcuts in floating point, so that sums keep their order. What they are given is
checked once, at each entry (`mvreg.kernels.checks`): inside there are no bounds checks.
"""
