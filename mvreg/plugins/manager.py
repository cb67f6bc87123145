"""The plugin manager: finds plugins, collects their stages, passes events to observers.

A plugin is an entry point in the group ``mvreg``; whatever function of it is called ``mvreg_*`` is
a hook. The prefix is enough, the marker
`mvreg.plugins.hookspecs.hookimpl` is welcome: so a misspelt hook is noticed.
"""

from __future__ import annotations

import traceback
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING

from mvreg.errors import PluginError
from mvreg.plugins.formats import collect_formats
from mvreg.plugins.pluggy_manager import GROUP, HOOKS, Manager
from mvreg.plugins.registry import Registered, register_all

if TYPE_CHECKING:
    from mvreg.events import Event
    from mvreg.io import Format


class ObserverWarning(RuntimeWarning):
    """An observer failed and was switched off; the run went on without it."""


def build(found: Iterable[EntryPoint]) -> Manager:
    """A manager with the plugins that the entry points name.

    Raises
    ------
    PluginError
        If a plugin cannot be imported or used; names it, its distribution and the cause.
    """
    manager = Manager()
    for entry in found:
        origin = f"{entry.dist.name} {entry.dist.version}" if entry.dist else "no distribution"
        try:
            plugin = entry.load()
        except (Exception, SystemExit) as cause:
            remove = f"pip uninstall {entry.dist.name}" if entry.dist else "remove it"
            raise PluginError(
                f"plugin {entry.name!r} ({origin}) cannot be imported from {entry.value!r}: "
                f"{type(cause).__name__}: {cause}; {what_to_do(cause, entry)}, or: {remove}"
            ) from cause
        manager.add(plugin, entry.name, origin)
        if not manager.get_hookcallers(plugin):
            raise PluginError(
                f"plugin {entry.name!r} ({origin}) brings nothing: expected a function called one "
                f"of {', '.join(HOOKS)} in {entry.value!r}, got none"
            )
    return manager


def what_to_do(cause: BaseException, entry: EntryPoint) -> str:
    """What mends a plugin that cannot be imported, where it can be told."""
    own = isinstance(cause, ModuleNotFoundError) and cause.name == entry.module
    attribute = isinstance(cause, AttributeError) and bool(entry.attr)
    if own or (attribute and getattr(cause, "name", None) == entry.attr):
        return "the entry point has to name a module, or module:object"
    if isinstance(cause, ImportError):
        return "install what it needs"
    package = entry.module.partition(".")[0]
    steps = [
        step for step in traceback.extract_tb(cause.__traceback__)
        if package in (Path(step.filename).stem, *Path(step.filename).parts)
    ]  # fmt: skip
    if isinstance(cause, SyntaxError) or not steps:
        return "mend it"
    return f"mend it at {steps[-1].filename}:{steps[-1].lineno}"


@cache
def current() -> Manager:
    """The manager of this process, with every installed plugin."""
    return build(entry_points(group=GROUP))


@cache
def stages() -> dict[str, Registered]:
    """Every registered stage by its key, ``"refine/tricp"``.

    Raises
    ------
    PluginError
        If a plugin is broken, or a stage is not what `mvreg.contracts` asks for.
    """
    return register_all(current())


@cache
def formats() -> dict[str, Format]:
    """Every file format that can be read, by its lower-case suffix.

    Raises
    ------
    PluginError
        If a plugin is broken, or what it returns are no formats.
    """
    return collect_formats(current())


def emit(event: Event) -> None:
    """Pass an event to every observer; one that raises is switched off, and the run goes on."""
    in_use = current()
    for hook in reversed(in_use.hook.mvreg_event.get_hookimpls()):  # pluggy's order of calls
        if id(hook.plugin) in in_use.muted:
            continue
        try:
            hook.function(*[event for _ in hook.argnames])
        except Exception as cause:
            in_use.muted.add(id(hook.plugin))
            name = getattr(hook.plugin, "__name__", type(hook.plugin).__qualname__)
            if hook.plugin_name in in_use.origins:
                name = f"{name} ({in_use.origins[hook.plugin_name]})"
            warnings.warn(
                f"observer {name} failed on {type(event).__name__} and is off for the rest of "
                f"the run: {type(cause).__name__}: {cause}",
                ObserverWarning,
                stacklevel=2,
            )


@contextmanager
def observing(*observers: object) -> Iterator[None]:
    """Let `observers` see the events of one run; they are called in the order given.

    Raises
    ------
    PluginError
        If one of them has a misspelt hook.
    """
    in_use = current()
    in_use.muted.clear()
    try:
        for observer in reversed(observers):
            in_use.add(observer)
        yield
    finally:
        for observer in observers:
            if in_use.is_registered(observer):
                in_use.unregister(observer)
