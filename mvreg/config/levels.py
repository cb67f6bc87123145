"""Levels of a strategy in the composed configuration: what the user says holds at each of them.

A strategy such as ``grow`` varies parameters of other stages from level to level, and its levels
say so in the configuration. Which of them apply is decided when a configuration is composed, so
that ``--cfg job``, ``result.json`` and the run agree:

- a parameter that the user sets is the user's at every level, whatever its value;
- a parameter that the chosen stage does not have, and another of its kind has, does not apply;
- levels that are the same then are one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import DictConfig, ListConfig, OmegaConf, open_dict

from mvreg.errors import InputError
from mvreg.plugins import manager

#: Where strategies keep their levels.
LEVELS = "strategy.levels"


class Loader(ConfigLoaderImpl):
    """Hydra's loader of configurations, for runs, jobs of a sweep and ``--cfg`` alike.

    Hydra 1.3 has no hook between composing a configuration and showing it.
    """

    def load_configuration(self, *args: Any, **kwargs: Any) -> DictConfig:
        """Compose a configuration, and settle its levels."""
        config: DictConfig = super().load_configuration(*args, **kwargs)
        said = config.hydra.overrides.task
        settle(config, OmegaConf.to_container(said))  # type: ignore[arg-type] # interpolations, too
        return config


def settle(config: DictConfig, overrides: Sequence[str]) -> None:
    """Leave in the levels what applies, given what the user said; changes `config`.

    Parameters
    ----------
    config : DictConfig
        A composed configuration.
    overrides : sequence of str
        The user's, in Hydra's syntax: ``["+method=fcpma", "seed.top_fraction=0.3"]``.
    """
    levels = OmegaConf.select(config, LEVELS)
    if not isinstance(levels, ListConfig) or not all(isinstance(x, DictConfig) for x in levels):
        return
    said = set(names_in(overrides))
    kept: list[Any] = []
    for level in levels:
        plain = OmegaConf.to_container(level)
        assert isinstance(plain, dict)
        if LEVELS not in said:
            plain = {name: value for name, value in plain.items()
                     if name not in said and applies(str(name), config)}  # fmt: skip
        if not kept or plain != kept[-1]:
            kept.append(plain)
    with open_dict(config.strategy):
        config.strategy.levels = kept


def names_in(overrides: Sequence[str]) -> Iterator[str]:
    """The dotted names of the parameters that overrides set; group choices are none."""
    for each in OverridesParser.create().parse_overrides(list(overrides)):
        if "." in each.key_or_group:
            yield each.key_or_group


def applies(name: str, config: DictConfig) -> bool:
    """Whether ``kind.parameter`` is one of the chosen stage, or else of no stage: a mistake."""
    kind, _, parameter = name.partition(".")
    if parameter in parameters(config, kind):
        return True
    registered = [stage.cls for stage in manager.stages().values() if stage.kind == kind]
    return not any(parameter in {f.name for f in fields(cls)} for cls in registered)


def parameters(config: DictConfig, kind: str) -> list[str]:
    """The names of the parameters of the stage chosen for a kind; empty for no stage."""
    cls = OmegaConf.get_type(config[kind]) if config.get(kind) is not None else None
    return [field.name for field in fields(cls)] if cls and is_dataclass(cls) else []


def check_levels(config: DictConfig, kinds: Sequence[str]) -> None:
    """Refuse levels that name what no chosen stage has.

    Raises
    ------
    InputError
        Names the level's parameter, and what there is.
    """
    for level in OmegaConf.select(config, LEVELS) or ():
        for name in level if isinstance(level, Mapping | DictConfig) else ():
            kind, _, parameter = str(name).partition(".")
            options = parameters(config, kind) if kind in kinds else list(kinds)
            if kind not in kinds or parameter not in options:
                raise InputError(
                    f"{LEVELS}: cannot change {name!r}: expected kind.parameter of a stage that "
                    f"was chosen; options: {', '.join(options)}"
                )
