"""``python -m mvreg``, and the console script ``mvreg``."""

import gc
import sys

from mvreg.cli import interrupts

#: Python looks for cycles of garbage after so many new containers, instead of 700: what a command
#: imports and composes is a hundred thousand that stay. A command then takes a twelfth less time,
#: and as much memory.
THRESHOLDS = (20_000, 10, 10)


def main() -> int:
    """Run the command line in a process of its own, and return the exit code."""
    code = interrupts.INTERRUPTED
    try:
        interrupts.listen()
        gc.set_threshold(*THRESHOLDS)
        from mvreg.cli import main as cli

        found = cli.main()
        if not interrupts.interrupted():
            code = found
        interrupts.done()
    except KeyboardInterrupt:  # before the command line was ready for it, or after
        sys.stderr.write("interrupted\n")
        interrupts.done()
    finally:
        gc.freeze()  # all that is left ends with the process: no last look for garbage
    return code


if __name__ == "__main__":
    sys.exit(main())
