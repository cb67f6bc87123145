"""One function at a time, beside its reference: benchmarks by pytest-benchmark."""
