"""Plugins made up for tests: as objects in this process, or installed for a subprocess."""

import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import pytest

from mvreg import builtin
from mvreg.errors import InputError
from mvreg.plugins import manager
from mvreg.plugins.registry import register_all


@dataclass(frozen=True)
class Half:
    """Keep half of it.

    More text that a list does not show.
    """

    share: float = 0.5
    label: str | None = None

    def __post_init__(self) -> None:
        if self.share > 1:
            raise InputError(f"refine.share: expected at most 1, got {self.share}")
        if self.share < 0:
            raise ValueError("negative")

    def __call__(self, source, target, T_init): ...


@dataclass(frozen=True)
class Needy:
    """Cannot do without a path."""

    path: str

    def __call__(self, *arguments): ...


def plugin_with(table: object = None, path: object = None) -> SimpleNamespace:
    """A plugin as an object; like a module it carries plain functions."""
    plugin = SimpleNamespace()
    if table is not None:
        plugin.mvreg_stages = lambda: table
    if path is not None:
        plugin.mvreg_config_path = lambda: path
    return plugin


def use(monkeypatch: pytest.MonkeyPatch, **named: object) -> manager.Manager:
    """Let this process have the built-in stages and the plugins given, and no others."""
    made = manager.Manager()
    made.add(builtin, "mvreg", "mvreg 0")
    for name, plugin in named.items():
        made.add(plugin, name, f"dist-{name} 0.3")
    monkeypatch.setattr(manager, "current", lambda: made)
    monkeypatch.setattr(manager, "stages", cache(lambda: register_all(made)))
    return made


def install(folder: Path, name: str, source: str) -> None:
    """A module `name` and its metadata, as pip would put them into a folder of packages."""
    (folder / f"{name}.py").write_text(source)
    write_metadata(folder, f"dist-{name}", "0.3", {name: name})


def write_metadata(folder: Path, name: str, version: str, entries: Mapping[str, str]) -> None:
    """What pip writes beside the modules of a distribution with entry points of mvreg."""
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (info / "entry_points.txt").write_text(
        "[mvreg]\n" + "".join(f"{entry} = {value}\n" for entry, value in entries.items())
    )


def python(
    *words: str, packages: Path | str | None = None, cwd: Path, timeout: float = 60
) -> subprocess.CompletedProcess[str]:
    """Run Python with a folder of packages beside the installed ones."""
    path = os.pathsep.join(filter(None, [str(packages or ""), os.environ.get("PYTHONPATH")]))
    return subprocess.run(
        [sys.executable, *words],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )


def mvreg(
    *words: str, packages: Path | str | None = None, cwd: Path
) -> subprocess.CompletedProcess[str]:
    """Run ``python -m mvreg`` with a folder of packages beside the installed ones."""
    return python("-m", "mvreg", *words, packages=packages, cwd=cwd)


def refused(name: str, packages: Path) -> str:
    """What ``mvreg plugins`` says where the plugin `name` is broken: one line, and names it."""
    done = mvreg("plugins", packages=packages, cwd=packages)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: ") and done.stderr.count("\n") == 1
    assert f"dist-{name} 0.3" in done.stderr
    return done.stderr
