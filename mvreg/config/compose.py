"""From overrides to objects: compose a configuration, and read the stages back from it.

A stage's key is its Hydra address and its dataclass its schema, so YAML only composes: what it can
name are the registered stages, read back with `OmegaConf.to_object` as frozen, validated objects.
There is no ``_target_``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import fields, is_dataclass
from typing import Any

from hydra.core.global_hydra import GlobalHydra
from hydra.version import VersionBase
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from mvreg.config.known_plugins import refuse_stand_in
from mvreg.config.levels import check_levels
from mvreg.config.messages import explained, no_such_key
from mvreg.config.store import Schema, registered
from mvreg.contracts import KINDS
from mvreg.errors import InputError, MvregError
from mvreg.execution.shards import Shards
from mvreg.execution.threads import Executor, Threads
from mvreg.plugins import manager
from mvreg.stage_calls.culprit import stage_error

VERSION_BASE = "1.3"


def compose(overrides: Sequence[str] = ()) -> DictConfig:
    """Compose the configuration of a run, as the command line would.

    Works from any folder, and inside another Hydra application, which it leaves as it was.

    Parameters
    ----------
    overrides : sequence of str
        In Hydra's syntax: ``["+method=fcpma", "seed.top_fraction=0.5"]``.

    Raises
    ------
    InputError
        For an unknown stage, preset or parameter, or a value of the wrong type; lists the options.
    PluginError
        If a plugin is broken.
    """
    import hydra

    with registered(), process_state_kept(), explained():
        start = hydra.initialize_config_module("mvreg.conf", "mvreg", version_base=VERSION_BASE)
        with start:
            config = hydra.compose("config", overrides=list(overrides))
    check(config)
    return config


@contextmanager
def process_state_kept() -> Iterator[None]:
    """Hydra keeps one application and one version_base per process: leave the caller's alone."""
    version, application = copy(VersionBase.instance()), GlobalHydra.instance().hydra
    GlobalHydra.instance().clear()
    try:
        yield
    finally:
        GlobalHydra.instance().hydra = application
        VersionBase.set_instance(version)


def check(config: DictConfig) -> None:
    """Refuse what Hydra lets in: ``+methd=fcpma`` would add a key that nothing reads.

    Raises
    ------
    InputError
        For a key that neither the schema nor the stage has, a method that is not installed, a kind
        without a stage, a level that names no parameter, or a negative `rng`; says what there is.
    """
    known = [field.name for field in fields(Schema)]
    if unknown := sorted({str(key) for key in config} - set(known)):
        raise InputError(no_such_key(unknown[0], known))
    refuse_stand_in(config)
    for kind in KINDS:
        if kind not in config or OmegaConf.is_missing(config, kind) or config[kind] is None:
            raise InputError(f"{kind} needs a choice: {kind}=NAME; options: {options(kind)}")
        cls = OmegaConf.get_type(config[kind])
        if is_dataclass(cls):
            names = [field.name for field in fields(cls)]
            if unknown := sorted({str(key) for key in config[kind]} - set(names)):
                raise InputError(no_such_key(f"{kind}.{unknown[0]}", names, cls))
    check_levels(config, [kind for kind in KINDS if kind not in ("dataset", "strategy", "adjust")])
    if config.rng < 0:
        raise InputError(f"rng: expected a whole number, 0 or more, got {config.rng}")


def options(kind: str) -> str:
    """The names of the registered stages of a kind, for messages."""
    return ", ".join(stage.name for stage in manager.stages().values() if stage.kind == kind)


def stage_from(config: DictConfig, kind: str) -> Any:
    """The stage of one kind that a configuration describes: frozen, validated, ready to call.

    Raises
    ------
    InputError
        If a parameter is missing or out of range, or the node is not a registered stage.
    """
    node = config[kind]
    names = {s.cls: s.name for s in manager.stages().values() if s.kind == kind}
    found = OmegaConf.get_type(node)
    if found not in names:
        raise InputError(
            f"{kind}: expected a registered stage, got a plain mapping; a preset must begin with "
            f"'defaults: [NAME, _self_]'; options: {options(kind)}"
        )
    with explained():
        if missing := sorted(OmegaConf.missing_keys(node)):
            wanted = ", ".join(f"{name}=..." for name in missing)
            raise InputError(f"{kind}={names[found]} needs a value for {wanted}")
        try:
            return OmegaConf.to_object(node)
        except (MvregError, OmegaConfBaseException):
            raise
        except (TypeError, ValueError) as error:  # from a plugin's __post_init__
            raise InputError(f"{kind}={names[found]}: {error}") from error
        except Exception as error:  # a bug there
            raise stage_error(kind, "__post_init__", found, error) from error


def stages_from(config: DictConfig) -> dict[str, Any]:
    """Every stage of a configuration by its kind, the data set excepted."""
    return {kind: stage_from(config, kind) for kind in KINDS if kind != "dataset"}


def executor_from(config: DictConfig) -> Executor:
    """Who works, as a configuration says; ``shard=i/n`` is short for ``executor=shards``.

    Raises
    ------
    InputError
        For a value out of range, or a shard beside another executor.
    """
    with explained():
        found: Any = OmegaConf.to_object(config.executor)
    if config.shard:
        if not isinstance(found, Threads | Shards):
            raise InputError(f"shard={config.shard}: expected no other executor, got {found}")
        return Shards(str(config.shard))
    executor: Executor = found
    return executor
