"""Finished runs, found in folders: what each was told, and what it measured."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mvreg.errors import InputError
from mvreg.report.json_file import load_report
from mvreg.report.run_folder import overrides_of

#: A scan further from its truth than this (degrees) is falsely placed.
FALSE = 5.0
#: What repeats a run, or changes nothing about its result, and what has a column of its own.
REPEATS = ("rng", "dataset.order", "dataset.noise_rng")
ASIDE = (
    "method", "dataset", "experiment", "rerun", "report", "resume", "debug", "hydra",
)  # fmt: skip


@dataclass(frozen=True)
class Told:
    """A finished run: `settings` is what its configuration says beyond data set and method.

    `values` has its quantities by name, see `mvreg.report.comparison.table.QUANTITIES`; None is
    not known.
    """

    folder: Path
    dataset: str
    method: str
    unit: str
    total: int
    settings: Mapping[str, str]
    values: Mapping[str, float | None]


def find(places: Iterable[str | Path]) -> list[Told]:
    """Every finished run in or below the places, each once, in their order.

    Parameters
    ----------
    places : iterable of str or Path
        Run folders, folders that have runs below them, and patterns of such.

    Raises
    ------
    InputError
        For a place with no finished run, and one that cannot be read.
    """
    found: dict[Path, Told] = {}
    for place in places:
        below = list(_reports(str(place)))
        if not below:
            raise InputError(
                f"{place}: expected a run folder, or a folder or pattern of such, found no "
                "result.json there"
            )
        for file in below:
            if file.resolve() not in found:
                found[file.resolve()] = told(file.parent)
    return list(found.values())


def _reports(place: str) -> Iterator[Path]:
    matches = sorted(glob.glob(place)) if glob.has_magic(place) else [place]  # noqa: PTH207
    for match in map(Path, matches):
        if (match / "result.json").is_file():
            yield match / "result.json"
        elif match.is_dir():
            files = sorted(match.rglob("result.json"))
            yield from (file for file in files if not file.parent.is_symlink())


def told(folder: Path) -> Told:
    """What the run in a folder was told, and what it measured."""
    report = load_report(folder)
    return Told(
        folder=folder,
        dataset=str(report.get("dataset")),
        method=str(report.get("method")),
        unit=str(report.get("unit") or "file"),
        total=len(report.get("scans") or []),
        settings=settings(folder, report.get("config") or {}),
        values=values_of(report),
    )


def values_of(report: Mapping[str, Any]) -> dict[str, float | None]:
    """What a run measured, by the names of the quantities; None where it is not known.

    `false` counts the scans of every partial model; `consistency_resolutions` is `consistency` in
    resolutions, which compares between data sets.

    Parameters
    ----------
    report : mapping
        As in ``result.json``.
    """
    parts = report.get("components") or []
    errors = [one for one in (report.get("errors"), *(p.get("errors") for p in parts)) if one]
    scans = [error for one in errors for error in (one.get("scans") or {}).values()]
    mean = (report.get("errors") or {}).get("mean") or {}
    apart = report.get("consistency") or {}
    return {
        "placed": float(len(report.get("poses") or {})),
        "false": float(sum(error["angle_deg"] > FALSE for error in scans)) if errors else None,
        "e_R": mean.get("rotation"),
        "e_t": mean.get("translation"),
        "consistency": apart.get("rms"),
        "consistency_resolutions": apart.get("rms_resolutions"),
        "attempts": report.get("num_pairs"),
        "time": (report.get("seconds") or {}).get("total"),
    }


def settings(folder: Path, config: Mapping[str, Any]) -> dict[str, str]:
    """What was said on the command line; where that is not kept, all parameters.

    What only repeats a run is left out: random numbers and orders.
    """
    said = overrides_of(folder)
    if said or (folder / ".hydra").is_dir():
        pairs = dict(word.lstrip("+~").partition("=")[::2] for word in said)
    else:
        pairs = dict(_flat(config))
    return {
        key: value for key, value in pairs.items()
        if key not in REPEATS and key not in ASIDE and not key.startswith("hydra")
    }  # fmt: skip


def _flat(config: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    for key, value in config.items():
        name = f"{above}{key}"
        if isinstance(value, Mapping):
            yield from _flat(value, f"{name}.")
        else:
            yield name, str(value)
