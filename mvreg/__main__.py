"""``python -m mvreg``, and the console script ``mvreg``."""

import sys

from mvreg.cli import main

__all__ = ["main"]

if __name__ == "__main__":
    sys.exit(main())
