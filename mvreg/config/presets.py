"""What can be chosen: stages, and presets on the Hydra search paths.

Hydra is not imported here, because ``--help`` cannot wait for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from mvreg.errors import PluginError
from mvreg.plugins import manager

CONFIG_PATH = "pkg://mvreg.conf"


def plugin_paths() -> list[tuple[str, Any]]:
    """Every plugin that has presets, for messages, and its Hydra search path.

    Raises
    ------
    PluginError
        If a plugin's hook fails; names it.
    """
    answers = manager.current().answers("mvreg_config_path")
    return [(answer.who, answer.value) for answer in answers]


def preset_paths() -> list[tuple[str, Any]]:
    """The same with mvreg's own first.

    Raises
    ------
    PluginError
        As `plugin_paths` does.
    """
    return [("plugin 'mvreg'", CONFIG_PATH), *plugin_paths()]


def choices() -> dict[str, list[str]]:
    """Every group with the names to choose from: methods first, then the kinds of stage."""
    found = list(manager.stages())
    for who, path in preset_paths():
        found += addresses(path, who)
    groups: dict[str, list[str]] = {"method": []}
    for group, _, name in (address.rpartition("/") for address in found):
        if group:
            groups.setdefault(group, []).append(name)
    return {group: sorted(names) for group, names in groups.items()}


def addresses(path: str, who: str) -> list[str]:
    """Addresses of the YAML files of a search path, ``["method/fcpma", ...]``, sorted.

    Parameters
    ----------
    path : str
        ``pkg://package.module``, or an absolute folder with or without ``file://``.
    who : str
        Whose it is, for the message.

    Raises
    ------
    PluginError
        If there is no such package or folder.
    """
    return sorted(walk(root(path, who), ""))


def root(path: object, who: str) -> Traversable:
    """The folder that a search path names."""
    advice = 'expected "pkg://PACKAGE" or an existing absolute folder'
    if not isinstance(path, str):
        raise PluginError(f"{who}: mvreg_config_path() returned {path!r}; {advice}")
    scheme, separator, rest = path.rpartition("://")
    if separator and scheme == "pkg":
        try:
            return resources.files(rest.replace("/", "."))
        except (ImportError, TypeError, ValueError) as cause:
            raise PluginError(
                f"{who}: cannot find the package of config path {path!r}: {cause}; {advice}, and "
                "that the package is installed with its YAML files"
            ) from cause
    folder = Path(rest)
    if scheme not in ("", "file") or not folder.is_absolute() or not folder.is_dir():
        raise PluginError(f"{who}: config path {path!r} does not exist; {advice}")
    return folder


def walk(folder: Traversable, prefix: str) -> Iterator[str]:
    """Addresses of the YAML files below a folder."""
    for entry in folder.iterdir():
        if entry.name.startswith((".", "__")):
            continue
        if entry.is_dir():
            yield from walk(entry, f"{prefix}{entry.name}/")
        elif entry.name.endswith(".yaml"):
            yield prefix + entry.name.removesuffix(".yaml")
