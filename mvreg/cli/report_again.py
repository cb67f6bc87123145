"""`mvreg report`: the page of a finished run once more, or a report of poses from elsewhere."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from mvreg.errors import InputError

DONE, NOT_PLACED = 0, 3


def report(arguments: Sequence[str]) -> int:
    """Make report.html of a finished run again; or, with --poses, judge poses from elsewhere."""
    parser = argparse.ArgumentParser(
        "mvreg report",
        description=report.__doc__,
        usage="mvreg report [RUN]\n"
        "       mvreg report --poses FILE [--out FOLDER] DIR [KEY=VALUE ...]",
    )
    parser.add_argument("folder", nargs="?", type=Path, help="a run folder, by default the newest; "
                        "with --poses the folder of the scans")  # fmt: skip
    parser.add_argument("changes", nargs="*", metavar="KEY=VALUE",
                        help="as for a run: dataset.unit=mm")  # fmt: skip
    parser.add_argument("--poses", type=Path, metavar="FILE", help="poses of the scans in DIR, "
                        "by file name; a scan without one counts as not placed")  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="the run folder to write; "
                        "by default runs/DIR/given/TIME")  # fmt: skip
    found = parser.parse_args(arguments)
    if found.poses is not None:
        if found.folder is None:
            raise InputError("expected the folder of the scans: mvreg report --poses FILE DIR")
        from mvreg.cli.given_poses import judge

        complete = judge(found.poses, found.folder, found.changes, found.out)
        return DONE if complete else NOT_PLACED
    if found.changes or found.out:
        raise InputError(
            "KEY=VALUE and --out go with --poses; the page of a run is made from the run's own "
            "configuration, in its own folder: mvreg report RUN"
        )
    from mvreg.cli.listing import newest

    page = page_again(newest(Path("runs")) if found.folder is None else found.folder)
    sys.stdout.write(f"{page}\n")
    return DONE


def page_again(folder: Path) -> Path:
    """Write ``report.html`` of a finished run from its ``result.json`` and its scans.

    Raises
    ------
    InputError
        If the run, its configuration or its scans are not there, or the scans are others.
    """
    from mvreg.cli.prepared import config_of, prepared
    from mvreg.config.finished import where_it_ran
    from mvreg.report.json_file import load_report
    from mvreg.report.page.render import write_page

    said = load_report(folder)
    folder = folder if folder.is_dir() else folder.parent
    config = config_of(folder, said)
    with where_it_ran(folder):
        scanset, views = prepared(config)
    wanted, found = ({str(row["name"]) for row in said["scans"]}, {s.name for s in scanset.scans})
    if wanted != found:
        odd = ", ".join(sorted(wanted ^ found)[:5])
        raise InputError(
            f"{folder}: expected the scans that the run registered, found others ({odd}); "
            "did the data set change since? Run mvreg again to register what is there now"
        )
    return write_page(folder, said, scanset, views)
