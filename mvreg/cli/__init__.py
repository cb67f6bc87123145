"""The command line: what the words typed after ``mvreg`` do."""
