"""Load the scans of a finished run again, from the configuration that its folder keeps."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mvreg.errors import InputError
from mvreg.types import ScanSet


def load_again(run: Path, report: Mapping[str, Any], scans: Path | None = None) -> ScanSet:
    """The scans of a run, as they were read for it.

    Parameters
    ----------
    run : Path
        The run folder; its ``.hydra`` says which data set it was.
    report : mapping
        Its report, whose ``config.dataset`` has the parameters.
    scans : Path, optional
        Where the files are now, for data sets with a ``dataset.path``.

    Raises
    ------
    InputError
        If the folder does not say which data set it was, or its scans cannot be found or read.
    """
    from mvreg.config.compose import compose
    from mvreg.config.finished import put_back, where_it_ran
    from mvreg.run import load_scans

    choice = _choice(run)
    config = compose([f"dataset={choice}"])
    parameters = dict((report.get("config") or {}).get("dataset") or {})
    if scans is not None:
        if "path" not in parameters:
            raise InputError(
                f"--scans: the run's data set, {choice}, has no folder of scans that could have "
                "moved; leave it out"
            )
        parameters["path"] = str(scans.expanduser().absolute())
    known = {str(key) for key in config.dataset}
    # Those of another version of mvreg are not ours to set.
    put_back(config, {"dataset": {k: v for k, v in parameters.items() if k in known}}, run)
    with where_it_ran(run):
        try:
            return load_scans(config, report.get("rng") or 0)
        except InputError as error:
            raise InputError(
                f"{run}: the scans of this run cannot be read again: {error}\n"
                "If they have moved, say where with --scans DIR; formats of poses need none"
            ) from error


def _choice(run: Path) -> str:
    """The name of the data set."""
    from omegaconf import OmegaConf

    file = run / ".hydra" / "hydra.yaml"
    try:
        kept: Any = OmegaConf.load(file)
        return str(kept.hydra.runtime.choices.dataset)
    except Exception as error:  # missing, cut short, or of something else
        raise InputError(
            f"{file}: expected what the command line leaves of a run's configuration, which says "
            f"where its scans are: {' '.join(str(error).split()) or type(error).__name__}; "
            "formats of poses need none"
        ) from None
