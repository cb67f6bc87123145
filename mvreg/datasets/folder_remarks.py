"""What is said of the files of a folder."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from mvreg.datasets.folder_scans import ReadScan
from mvreg.errors import few


def remarks_of(scans: Sequence[ReadScan]) -> tuple[str, ...]:
    """What the readers said, once for all the scans of which they said the same but for numbers."""
    said: dict[str, list[str]] = {}
    for each in scans:
        for remark in each.remarks:
            said.setdefault(re.sub(r"\d[\d,.]*", "#", remark), []).append(
                f"{each.scan.name}: {remark}"
            )
    return tuple(
        first + (f" (and {len(more)} more scan{'s' * (len(more) > 1)} alike)" if more else "")
        for first, *more in said.values()
    )


def remark_on_left_out(left_out: Mapping[str, str]) -> tuple[str, ...]:
    """What is said of files that hold no scans: one sentence, or nothing."""
    if not left_out:
        return ()
    reasons: dict[str, list[str]] = {}
    for name, why in left_out.items():
        reasons.setdefault(why, []).append(name)
    shown = [f"{few(names, 2)} ({why})" for why, names in list(reasons.items())[:3]]
    more = " and others" * (len(reasons) > 3)
    files = "1 file" if len(left_out) == 1 else f"{len(left_out)} files"
    return (f"left out {files} without a scan: {', '.join(shown)}{more}",)
