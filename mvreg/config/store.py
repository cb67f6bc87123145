"""A Hydra schema for every registered stage, stored under the stage's key."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.config_store import ConfigStore
from hydra.core.plugins import Plugins
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf import MISSING, DictConfig, OmegaConf

from mvreg.config.known_plugins import stand_ins
from mvreg.config.levels import Loader
from mvreg.config.presets import CONFIG_PATH, addresses, choices, plugin_paths, preset_paths
from mvreg.contracts import KINDS
from mvreg.errors import PluginError
from mvreg.execution import EXECUTORS
from mvreg.plugins import manager


@dataclass
class Schema:
    """The types of what ``config.yaml`` holds; their values stand there alone."""

    dataset: Any = MISSING
    downsample: Any = MISSING
    describe: Any = MISSING
    seed: Any = MISSING
    propagate: Any = MISSING
    refine: Any = MISSING
    judge: Any = MISSING
    augment: Any = MISSING
    strategy: Any = MISSING
    adjust: Any = MISSING
    method: str = MISSING
    rng: int = MISSING
    rerun: bool = MISSING
    report: bool = MISSING
    export: list[str] = MISSING
    executor: Any = MISSING
    shard: str = MISSING
    store: Any = MISSING
    store_size: float = MISSING
    resume: bool = MISSING
    debug: bool = MISSING


class MvregSearchPath(SearchPathPlugin):
    """Appends the plugins' presets, in mvreg's own runs only."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Append what the plugins return from `mvreg_config_path`."""
        if any(part.path == CONFIG_PATH for part in search_path.get_path()):
            for who, path in plugin_paths():
                search_path.append(f"mvreg {who}", path)


def nodes() -> dict[str, DictConfig]:
    """The schema of every registered stage, by key.

    Raises
    ------
    PluginError
        If OmegaConf has no place for a parameter's type; names plugin and stage.
    """
    made = {}
    for key, stage in manager.stages().items():
        try:
            node = OmegaConf.structured(stage.cls)
        except Exception as cause:
            reason = (str(cause).splitlines() or [type(cause).__name__])[0]
            raise PluginError(
                f"plugin {stage.plugin!r} ({stage.origin}): {key!r} has a parameter that a config "
                f"cannot hold: {reason}; use bool, int, float, str, Enum, list or dict"
            ) from cause
        OmegaConf.set_readonly(node, None)  # frozen dataclasses become read-only nodes
        made[key] = node
    return made


def refuse_shadows(keys: Iterable[str]) -> None:
    """Every address has one owner: no preset hides a stage, or a preset of someone else.

    Raises
    ------
    PluginError
        Names the address and both owners; or the plugin whose config path does not exist.
    """
    table = manager.stages()
    owners = {key: f"the stage of plugin {table[key].plugin!r}" for key in keys}
    for who, path in preset_paths():
        for address in addresses(path, who):
            if address in owners:
                raise PluginError(
                    f"{who} has a preset {address}.yaml ({path}), and there is {owners[address]} "
                    "of the same name: one would hide the other; rename one of them"
                )
            owners[address] = f"the preset of {who} ({path})"


@contextmanager
def registered() -> Iterator[None]:
    """Inside, Hydra knows mvreg's stages; afterwards its store is as it was.

    The store belongs to the whole process: another Hydra application in it may have groups of the
    same names, so ours are lent for a while, never left there; nor is our `Loader`.
    """
    ours = nodes()
    refuse_shadows(ours)
    Plugins.instance().register(MvregSearchPath)  # loads Hydra's own entries of the store, too
    store = ConfigStore.instance()
    application: Any = import_module("hydra._internal.hydra")
    before, loader = store.repo, application.ConfigLoaderImpl
    store.repo = {
        key: value for key, value in before.items() if key not in {*KINDS, "method", "executor"}
    }
    try:
        store.store("mvreg_schema", Schema, provider="mvreg")
        for key, node in ours.items():
            kind, _, name = key.partition("/")
            store.store(name, node, group=kind, provider="mvreg")
        for name, cls in EXECUTORS.items():
            node = OmegaConf.structured(cls)
            OmegaConf.set_readonly(node, None)
            store.store(name, node, group="executor", provider="mvreg")
        for name, preset in stand_ins(choices()["method"]).items():
            store.store(name, preset, group="method", package="_global_", provider="mvreg")
        application.ConfigLoaderImpl = Loader
        yield
    finally:
        application.ConfigLoaderImpl = loader
        store.repo = before
