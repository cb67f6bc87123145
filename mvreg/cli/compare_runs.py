"""`mvreg compare`: a table over finished runs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from mvreg.errors import InputError


def compare(arguments: Sequence[str]) -> int:
    """Print a table over finished runs, those that repeat each other in one row."""
    from mvreg.report.comparison.formats import ENDINGS, FORMATS, printed
    from mvreg.report.comparison.runs import find
    from mvreg.report.comparison.table import tabled
    from mvreg.report.run_folder import write_text
    from mvreg.report.table import open_console

    parser = argparse.ArgumentParser("mvreg compare", description=compare.__doc__)
    parser.add_argument("runs", nargs="*", default=["runs"],
                        help="run folders, folders of such, patterns; by default runs")  # fmt: skip
    parser.add_argument("--format", choices=["terminal", *FORMATS],
                        help="by default what --out ends in, or for the terminal")  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="FILE", help="write a file")
    found = parser.parse_args(arguments)
    form = found.format or (ENDINGS.get(found.out.suffix.lower()) if found.out else "terminal")
    if form is None or (found.out and form == "terminal"):
        raise InputError(
            f"--out {found.out}: expected a name that ends in {', '.join(ENDINGS)}, or a --format "
            f"of {', '.join(FORMATS)}"
        )
    table = tabled(find(found.runs))
    if form == "terminal":
        open_console(sys.stdout).print(printed(table))
        return 0
    text = FORMATS[form](table)
    if found.out is None:
        sys.stdout.write(text)
        return 0
    try:
        write_text(found.out, text)
    except OSError as error:
        raise InputError(
            f"cannot write {found.out}: {error.strerror or error}; choose another with --out FILE"
        ) from None
    sys.stdout.write(f"{found.out}\n")
    return 0
