"""`mvreg export`: a finished run in the formats of other programs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mvreg.errors import MvregError

if TYPE_CHECKING:
    from mvreg.types import ScanSet, View

#: Below a run folder, where exports go unless said otherwise.
FOLDER = "export"


def export(arguments: Sequence[str]) -> int:
    """Write the poses and the points of a finished run in the formats of other programs."""
    from mvreg.export.table import formats_of, listing

    parser = _parser(listing())
    asked = parser.parse_args(arguments)
    if asked.list:
        sys.stdout.write(listing())
        return 0
    if asked.run is None or not asked.formats:
        parser.error("expected a run folder and at least one format; mvreg export --list has them")
    formats = formats_of(asked.formats)
    from mvreg.report.json_file import load_report

    report = load_report(asked.run)
    run = asked.run if asked.run.is_dir() else asked.run.parent
    out = asked.out or run / FOLDER

    def scans() -> ScanSet:
        from mvreg.export.again import load_again

        return load_again(run, report, asked.scans)

    def views(scanset: ScanSet) -> Sequence[View]:
        return views_again(run, report, scanset)

    from mvreg.export.run import export as write
    from mvreg.export.targets import Targets

    targets = Targets.read(*asked.targets) if asked.targets else None
    tell(write(report, formats, out, scans, views, targets))
    sys.stdout.write(f"written to {out}: {', '.join(each.name for each in formats)}\n")
    return 0


def _parser(formats: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "mvreg export", description=export.__doc__, epilog=f"formats:\n{formats}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("run", nargs="?", type=Path, metavar="RUN", help="a run folder")
    parser.add_argument("formats", nargs="*", metavar="FORMAT", help="one or more of the below")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where to; by default RUN/export")
    parser.add_argument("--scans", type=Path, metavar="DIR", help="where the scans are now")
    parser.add_argument(
        "--targets",
        nargs=2,
        type=Path,
        metavar=("MEASURED", "MAP"),
        help="into the frame of a map: tables of targets as measured in scans, and as in the map",
    )
    parser.add_argument("--list", action="store_true", help="list the formats, and do nothing else")
    return parser


def views_again(run: Path, report: dict[str, Any], scanset: ScanSet) -> Sequence[View]:
    """The scans of a finished run as its method prepared them; none, and why, where it cannot."""
    from mvreg.cli.prepared import config_of, views_of

    try:
        return views_of(config_of(run, report), scanset)
    except MvregError as error:  # the method's plugin may be gone, or the run of another version
        tell([f"without residuals: the scans cannot be prepared as they were: {error}"])
        return ()


def tell(remarks: Iterable[str]) -> None:
    """Say what there is to be said, a line each, on standard error."""
    for remark in remarks:
        sys.stderr.write(f"{remark}\n")
