"""Levels of a strategy in the composed configuration: what the user says holds at each of them.

A strategy such as ``grow`` varies parameters of other stages from level to level, and its levels
say so in the configuration. Which of them apply is decided when a configuration is composed, so
that ``--cfg job``, ``result.json`` and the run agree:

- a parameter that the user sets is the user's at every level, whatever its value, be it set by
  itself, in a mapping or by an experiment; a method's own values are not the user's;
- a parameter that the chosen stage does not have, and another of its kind has, does not apply;
- levels that are the same then are one;
- levels that the user writes are left alone.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import DictConfig, ListConfig, OmegaConf, open_dict

from mvreg.contracts import KINDS
from mvreg.errors import InputError
from mvreg.plugins import manager

#: Where strategies keep their levels.
LEVELS = "strategy.levels"
#: The group of presets whose values are the user's.
EXPERIMENT = "experiment"


class Loader(ConfigLoaderImpl):
    """Hydra's loader of configurations, for runs, jobs of a sweep and ``--cfg`` alike.

    Hydra 1.3 has no hook between composing a configuration and showing it.
    """

    def load_configuration(self, *args: Any, **kwargs: Any) -> DictConfig:
        """Compose a configuration, and settle its levels."""
        config: DictConfig = super().load_configuration(*args, **kwargs)
        task = OmegaConf.to_container(config.hydra.overrides.task)  # interpolations, too
        overrides = [str(each) for each in task or ()]
        said = {*names_in(overrides), *self.names_in_experiments(overrides)}
        settle(config, said)
        return config

    def names_in_experiments(self, overrides: Sequence[str]) -> Iterator[str]:
        """The dotted names of the parameters that the chosen experiments set."""
        for each in OverridesParser.create().parse_overrides(list(overrides)):
            if each.key_or_group != EXPERIMENT:
                continue
            chosen = each.value()
            for name in chosen if isinstance(chosen, list) else [chosen]:
                found = self.repository.load_config(f"{EXPERIMENT}/{name}")
                if found is not None and isinstance(found.config, DictConfig):
                    yield from parameters_in(found.config)


def parameters_in(preset: DictConfig) -> Iterator[str]:
    """The dotted names of the stages' parameters that a preset of the whole configuration sets."""
    for kind in KINDS:
        if isinstance(node := preset.get(kind), DictConfig):
            yield from (f"{kind}.{name!s}" for name in node)


def settle(config: DictConfig, said: Collection[str]) -> None:
    """Leave in the levels what applies, given what the user said; changes `config`.

    Parameters
    ----------
    config : DictConfig
        A composed configuration.
    said : collection of str
        The parameters that the user sets, by their dotted names: ``{"seed.top_fraction"}``.
    """
    levels = levels_of(config)
    if not levels or LEVELS in said:
        return
    kept: list[dict[str, Any]] = []
    for level in levels:
        left = {name: value for name, value in level.items()
                if name not in said and applies(name, config)}  # fmt: skip
        if not kept or left != kept[-1]:
            kept.append(left)
    with open_dict(config.strategy):
        config.strategy.levels = kept


def levels_of(config: DictConfig) -> list[dict[str, Any]]:
    """The levels of the chosen strategy, not resolved; empty for one that has no such mappings."""
    levels = OmegaConf.select(config, LEVELS)
    if not isinstance(levels, ListConfig) or not all(isinstance(x, DictConfig) for x in levels):
        return []
    return [{str(name): value for name, value in plain(level).items()} for level in levels]


def plain(node: DictConfig) -> dict[Any, Any]:
    """A node as a dict, its interpolations as they are."""
    found = OmegaConf.to_container(node)
    assert isinstance(found, dict)
    return found


def names_in(overrides: Sequence[str]) -> Iterator[str]:
    """The names, ``kind.parameter``, of what overrides set; choices of a stage are none.

    ``seed={top_fraction: 0.3}`` sets what ``seed.top_fraction=0.3`` sets, and ``strategy.levels.0``
    is a part of ``strategy.levels``.
    """
    for each in OverridesParser.create().parse_overrides(list(overrides)):
        kind, *parameter = each.key_or_group.split(".")[:2]
        if parameter:
            yield f"{kind}.{parameter[0]}"
        elif isinstance(value := each.value(), Mapping):
            yield from (f"{kind}.{name}" for name in value)


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
    for level in levels_of(config):
        for name in level:
            kind, _, parameter = name.partition(".")
            options = parameters(config, kind) if kind in kinds else list(kinds)
            if kind not in kinds or parameter not in options:
                raise InputError(
                    f"{LEVELS}: cannot change {name!r}: expected kind.parameter of a stage that "
                    f"was chosen; options: {', '.join(options)}"
                )
