"""The scans of a finished run once more, prepared as its method prepares them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mvreg.errors import InputError
from mvreg.report.run_folder import overrides_of

if TYPE_CHECKING:
    from omegaconf import DictConfig

    from mvreg.types import ScanSet, View


def config_of(folder: Path, said: dict[str, Any]) -> DictConfig:
    """The configuration of a finished run, ready to make its stages of it."""
    from mvreg.config.compose import compose
    from mvreg.config.finished import put_back

    config = compose(words_of(folder))
    put_back(config, said.get("config") or {}, folder)
    return config


def words_of(folder: Path) -> list[str]:
    """What was said on the command line of a run, but for Hydra's own.

    Raises
    ------
    InputError
        If the folder is of no run of the command line.
    """
    if not (folder / ".hydra" / "overrides.yaml").is_file():
        raise InputError(
            f"{folder}: expected .hydra/overrides.yaml, which says what was run; only runs of the "
            "command line have it"
        )
    return [word for word in overrides_of(folder) if not word.startswith("hydra.")]


def prepared(config: DictConfig) -> tuple[ScanSet, list[View]]:
    """The scans of a configuration, and as its method prepares them."""
    from mvreg.run import load_scans

    scanset = load_scans(config, config.rng)
    return scanset, views_of(config, scanset)


def views_of(config: DictConfig, scanset: ScanSet) -> list[View]:
    """Scans as the method of a configuration prepares them before it registers them."""
    from mvreg.run import method_from

    pipeline = method_from(config).pipeline.checked()
    return pipeline.prepare(scanset.scans, np.random.default_rng(config.rng))
