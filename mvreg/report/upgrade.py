"""Reports of earlier schemas, brought to the present one: keys that were renamed, and nothing else.

What each key of the present schema means is in ``SCHEMA.md`` beside this file.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mvreg.config.renamed import PARAMETERS

#: Raised when a key changes its meaning, its name, or goes away; new keys do not count.
#: 2: scans of partial models are no longer in `unregistered`, but in `components`.
#: 3: the field's own words; the five quantities that were called "overlap" have names of their own.
SCHEMA = 3
#: Schemas that can be read. What 1 says means the same as in 2, it only says less.
READABLE = (1, 2, SCHEMA)
#: What the evidence of a pair measures (schema 2 to 3).
EVIDENCE = {
    "overlap": "surface_overlap", "stability": "localizability", "pull": "residual_step",
}  # fmt: skip
#: The assessment of a scan, and the limits of its grades.
ASSESSMENT = {"overlap": "coverage", "within": "inlier_ratio", "balance": "strength"}
#: A link between two placed scans.
LINK = {"overlap": "contact_ratio"}


def upgraded(report: Mapping[str, Any]) -> dict[str, Any]:
    """A report of any readable schema in the words of the present one.

    Parameters
    ----------
    report : mapping
        As it was read; it is not changed.

    Returns
    -------
    dict
        The report itself where its schema is the present one. Numbers are never changed; keys that
        an old schema does not have stay missing.
    """
    found = dict(report)
    if found["schema"] == SCHEMA:
        return found
    found["schema"] = SCHEMA
    if found.get("scans"):
        found["scans"] = [_scan(row) for row in found["scans"]]
    if found.get("grades"):
        found["grades"] = renamed(found["grades"], ASSESSMENT)
    if found.get("links"):
        found["links"] = [renamed(row, LINK) for row in found["links"]]
    if found.get("pairs"):
        found["pairs"] = [_pair(row) for row in found["pairs"]]
    if found.get("config"):
        found["config"] = {kind: _stage(kind, node) for kind, node in found["config"].items()}
    return found


def renamed(row: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    """A mapping with some of its keys renamed, in the same order."""
    return {names.get(key, key): value for key, value in row.items()}


def _scan(row: Mapping[str, Any]) -> dict[str, Any]:
    found = dict(row)
    if found.get("assessment"):
        found["assessment"] = renamed(found["assessment"], ASSESSMENT)
    return found


def _pair(row: Mapping[str, Any]) -> dict[str, Any]:
    found = dict(row)
    if found.get("evidence"):
        found["evidence"] = renamed(found["evidence"], EVIDENCE)
    return found


def _stage(kind: str, node: Any) -> Any:
    """The parameters of one stage of a configuration, under the names that they have now."""
    if not isinstance(node, Mapping):
        return node
    names = {
        old.partition(".")[2]: new.partition(".")[2]
        for old, new in PARAMETERS.items()
        if old.startswith(f"{kind}.")
    }
    return renamed(node, names)
