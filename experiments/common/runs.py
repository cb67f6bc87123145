"""The results of the experiments: one record per job, finished, failed or not yet run.

    python -m mvreg -m +experiment=table1

keeps each job in ``runs/experiments/table1/<its overrides>``; ``runs("table1")`` reads them back.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

from mvreg.errors import InputError
from mvreg.report.json_file import load_report
from mvreg.report.run_folder import overrides_of

REPOSITORY = Path(__file__).resolve().parents[2]
PRESETS = REPOSITORY / "conf" / "experiment"
ROOT = REPOSITORY / "runs" / "experiments"


@dataclass(frozen=True)
class Run:
    """One job of an experiment.

    `overrides` are the job's own, such as ``("+method=fcpma", "dataset=bunny")``; `report` is its
    ``result.json``, None where there is no finished one, and `error` then says why.
    """

    folder: Path
    overrides: tuple[str, ...]
    report: Mapping[str, Any] | None
    error: str | None

    def value(self, key: str, default: str = "") -> str:
        """What the job sets `key` to: ``value("method")``, ``value("seed.top_fraction")``."""
        given = dict(override.lstrip("+").split("=", 1) for override in self.overrides)
        return str(given.get(key, default))


def experiments() -> list[str]:
    """The names of all experiments."""
    return sorted(file.stem for file in PRESETS.glob("*.yaml"))


def runs(experiment: str, root: Path = ROOT) -> list[Run]:
    """Every job of an experiment, in the order in which it is run.

    Parameters
    ----------
    experiment : str
        As in ``+experiment=table1``.
    root : Path
        The folder that holds the experiments' folders.

    Returns
    -------
    list of Run
        The jobs that the experiment consists of, also those that were not run; then whatever else
        lies there, such as jobs run with one more override.
    """
    folder = root / experiment
    wanted = [(folder / dirname(overrides), overrides) for overrides in plan(experiment)]
    known = {place for place, _ in wanted}
    others = [found for found in sorted(_found(folder)) if found[0] not in known]
    return [_read(place, overrides) for place, overrides in [*wanted, *others]]


def planned(experiment: str, root: Path = ROOT) -> list[Run]:
    """The jobs that an experiment consists of; not those with overrides of one's own."""
    return runs(experiment, root)[: len(plan(experiment))]


def plan(experiment: str) -> list[tuple[str, ...]]:
    """The overrides of every job of an experiment, as its preset says.

    Raises
    ------
    InputError
        If there is no such experiment; lists them.
    """
    from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
    from hydra.core.override_parser.overrides_parser import OverridesParser

    file = PRESETS / f"{experiment}.yaml"
    if not file.is_file():
        raise InputError(f"no experiment {experiment!r}; there are: {', '.join(experiments())}")
    params = OmegaConf.select(OmegaConf.load(file), "hydra.sweeper.params")
    words = [f"{key}={value}" for key, value in params.items()]
    parsed = OverridesParser.create().parse_overrides(words)
    (jobs,) = BasicSweeper.split_arguments(parsed, max_batch_size=None)
    return [tuple(job) for job in jobs]


def dirname(overrides: Sequence[str]) -> str:
    """A job's folder in its experiment's, Hydra's ``override_dirname``."""
    return ",".join(sorted(overrides))


def _found(folder: Path) -> Iterator[tuple[Path, tuple[str, ...]]]:
    """The folders below one that hold a job, with its overrides; links are left out."""
    for file in folder.rglob(".hydra/overrides.yaml"):
        place = file.parent.parent
        if not place.is_symlink():
            yield place, _overrides(place)


def read(folder: Path) -> Run:
    """The record of the job in a folder, whatever experiment it belongs to."""
    return _read(folder, _overrides(folder))


def _overrides(folder: Path) -> tuple[str, ...]:
    """What a job in a folder was given, less the name of its experiment."""
    given = overrides_of(folder)
    return tuple(each for each in given if not each.startswith("+experiment="))


def _read(folder: Path, overrides: tuple[str, ...]) -> Run:
    """The record of one job."""
    if (folder / "error.txt").is_file():
        return Run(folder, overrides, None, (folder / "error.txt").read_text("utf-8").strip())
    if not (folder / "result.json").is_file():
        started = (folder / ".hydra").is_dir()
        return Run(folder, overrides, None, "cut short" if started else "not run")
    try:
        report = load_report(folder)
    except InputError as error:
        return Run(folder, overrides, None, str(error))
    if report.get("status") == "interrupted":
        return Run(folder, overrides, None, "interrupted")
    return Run(folder, overrides, report, None)
