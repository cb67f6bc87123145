"""Check the plugins that are installed: whether they load, and do what their contracts ask."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from importlib.metadata import EntryPoint, entry_points

from mvreg.errors import InputError, MvregError, few
from mvreg.export import table
from mvreg.export.brought import collect_exports
from mvreg.export.formats import Format as ExportFormat
from mvreg.io import Format
from mvreg.kit.besides import check_observer, check_presets
from mvreg.kit.formats import EXPORT, READER, check_export, check_reader
from mvreg.kit.outcomes import Outcome, Status, Subject
from mvreg.kit.stages import check_stage
from mvreg.plugins import manager
from mvreg.plugins.formats import Guarded, collect_formats
from mvreg.plugins.pluggy_manager import GROUP, HERE, HOOKS, Manager
from mvreg.plugins.registry import Registered, register_all

#: The entry point of mvreg's own stages.
CORE = "mvreg"


@dataclass(frozen=True)
class Installed:
    """An entry point and what it brings; `broken` says why it brings nothing."""

    name: str
    origin: str
    manager: Manager | None
    stages: Mapping[str, Registered]
    suites: Mapping[str, type]
    broken: str = ""
    exports: Mapping[str, ExportFormat] = field(default_factory=dict)
    readers: Mapping[str, Format] = field(default_factory=dict)

    @property
    def keys(self) -> list[str]:
        """What can be checked by itself: stages, ``export/NAME``, ``reader/NAME``."""
        exports = [f"{EXPORT}{name}" for name in self.exports]
        return [*self.stages, *exports, *(f"{READER}{name}" for name in self.readers)]

    @property
    def distribution(self) -> str:
        """The name of the distribution, without its version."""
        return self.origin.rpartition(" ")[0] or self.origin

    @property
    def hooks(self) -> list[str]:
        """The hooks that it implements."""
        if self.manager is None:
            return []
        return [name for name in HOOKS if getattr(self.manager.hook, name).get_hookimpls()]


def installed() -> list[Installed]:
    """Every plugin, each on its own: one that is broken hides no other."""
    return [examined(entry) for entry in sorted(entry_points(group=GROUP), key=lambda e: e.name)]


def examined(entry: EntryPoint) -> Installed:
    """Load one plugin."""
    origin = f"{entry.dist.name} {entry.dist.version}" if entry.dist else HERE
    try:
        alone = manager.build([entry])
        stages = register_all(alone)
        readers = {
            each.name: each
            for each in collect_formats(alone).values()
            if isinstance(each.read, Guarded)
        }
        exports = collect_exports(alone, table.BY_NAME)
        return Installed(
            entry.name, origin, alone, stages, suites_of(alone), exports=exports, readers=readers
        )
    except MvregError as error:
        return Installed(entry.name, origin, None, {}, {}, str(error))


def suites_of(alone: Manager) -> dict[str, type]:
    """What a plugin's ``mvreg_suites`` returns.

    Raises
    ------
    PluginError
        If it fails, or is no mapping.
    """
    found: dict[str, type] = {}
    for answer in alone.answers("mvreg_suites", taken_as=dict):
        found |= answer.value
    return found


def check_plugins(asked: str | None, core: bool = False) -> Iterator[Outcome]:
    """Check what is installed, or a part of it.

    Parameters
    ----------
    asked : str, optional
        A plugin's name, its distribution's, or a stage as ``kind=name``; None for all but mvreg's
        own.
    core : bool
        mvreg's own, too.

    Raises
    ------
    InputError
        If there is no such plugin or stage; lists them.
    """
    known = installed()
    key = (asked or "").replace("=", "/")
    chosen = [one for one in known if asked in (one.name, one.distribution) or key in one.keys]
    if asked is None:
        chosen = [one for one in known if core or one.name != CORE]
    elif not chosen:
        names = few([f"{one.name} ({one.distribution})" for one in known])
        raise InputError(
            f"mvreg plugins check: expected a plugin, a distribution or a stage as kind=name, got "
            f"{asked!r}; {without_entry_point(asked)}plugins: {names}; "
            "mvreg plugins lists the stages"
        )
    for one in chosen:
        yield from check_one(one, key if key in one.keys else None)
    if chosen and not any(one.broken for one in known):
        yield from check_together([one.origin for one in chosen])


def without_entry_point(asked: str) -> str:
    """What is said of a distribution that is installed, but is no plugin; empty for any other."""
    for name in (asked, f"mvreg-{asked}"):
        try:
            version = metadata.version(name)
        except (metadata.PackageNotFoundError, ValueError):
            continue
        return (
            f"{name} {version} is installed, but has no entry point in the group {GROUP!r}: write "
            f"[project.entry-points.{GROUP}] in its pyproject.toml and install it again; "
        )
    return ""


def check_one(one: Installed, only: str | None) -> Iterator[Outcome]:
    """Check what a plugin brings, or a single stage."""
    subject = Subject("the plugin", one.name, one.origin)
    if one.broken:
        yield subject.outcome("it can be used", Status.failed, one.broken)
        return
    if not one.hooks:
        yield subject.outcome(
            "it has a hook", Status.failed,
            f"expected a function called one of {', '.join(HOOKS)}; got none",
        )  # fmt: skip
    elif not one.keys and not {"mvreg_event", "mvreg_config_path"} & set(one.hooks):
        yield subject.outcome(
            "it brings something", Status.failed,
            f"expected {' or '.join(one.hooks)} to return something; got nothing",
        )  # fmt: skip
    if strange := sorted(set(one.suites) - set(one.keys)):
        yield subject.outcome(
            "its suites are of its stages", Status.failed,
            f"expected keys of its stages from mvreg_suites(), {few(one.keys)}; "
            f"got {few(strange)}",
        )  # fmt: skip
    for key, entry in one.stages.items():
        if only in (None, key):
            yield from check_stage(entry, one.suites)
    for name, each in one.exports.items():
        if only in (None, f"{EXPORT}{name}"):
            yield from check_export(each, one.suites, one.name, one.origin)
    for name, reader in one.readers.items():
        if only in (None, f"{READER}{name}"):
            yield from check_reader(reader, one.suites, one.name, one.origin)
    if only is None and one.manager is not None:
        if "mvreg_event" in one.hooks:
            yield from check_observer(one.manager, one.name, one.origin)
        if "mvreg_config_path" in one.hooks:
            yield from check_presets(one.manager, one.name, one.origin)


def check_together(origins: Sequence[str]) -> Iterator[Outcome]:
    """Whether plugins go with all others: no name, no key and no suffix twice."""
    subject = Subject("all plugins", "all", "together")

    def meet() -> None:
        manager.stages()
        manager.formats()
        table.formats()

    found = subject.asked("they go with each other", meet)
    if found.status is Status.failed and any(origin in found.text for origin in origins):
        yield found
