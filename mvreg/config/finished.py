"""The configuration of a finished run once more, from what its folder keeps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from mvreg.errors import InputError


def put_back(config: DictConfig, used: Mapping[str, Any], folder: Path) -> None:
    """Set the parameters that a run used: defaults may have changed since.

    Parameters
    ----------
    config : DictConfig
        Composed as the run's was; changed in place.
    used : mapping
        ``config`` of the run's ``result.json``. Where it has None, what was composed stays: JSON
        has no infinities, and None stands for them.
    folder : Path
        The run folder, for messages.

    Raises
    ------
    InputError
        For a parameter that there is not, or of another type.
    """
    composed = OmegaConf.to_container(config)
    assert isinstance(composed, dict)
    try:
        for key, value in used.items():
            OmegaConf.update(config, str(key), _filled(value, composed.get(key)), merge=True)
    except OmegaConfBaseException as error:
        raise InputError(
            f"{folder}: its configuration is not one of this version of mvreg "
            f"({str(error).splitlines()[0]}); run mvreg again"
        ) from None


def _filled(value: Any, composed: Any) -> Any:
    """The value, and what was composed where it has None."""
    if value is None:
        return composed
    if isinstance(value, Mapping) and isinstance(composed, Mapping):
        return {key: _filled(item, composed.get(key)) for key, item in value.items()}
    if isinstance(value, list) and isinstance(composed, list) and len(value) == len(composed):
        return [_filled(*both) for both in zip(value, composed, strict=True)]
    return value


@contextmanager
def where_it_ran(folder: Path) -> Iterator[None]:
    """Be in the folder that a run was started in: its configuration may name files from there.

    Stays where it is if the run folder does not say, or that folder is gone.
    """
    try:
        kept: Any = OmegaConf.load(folder / ".hydra" / "hydra.yaml")
        start = Path(str(kept.hydra.runtime.cwd))
    except Exception:  # missing, cut short, or of something else
        start = Path()
    with chdir(start if start.is_dir() else Path()):
        yield
