"""The plugin manager: finds plugins, collects their stages, passes events to observers.

A plugin is an entry point in the group ``mvreg``; whatever function of it is called ``mvreg_*`` is
a hook. The prefix is enough, the marker
`mvreg.plugins.hookspecs.hookimpl` is welcome: so a misspelt hook is noticed.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING

from mvreg.errors import PluginError
from mvreg.plugins.formats import collect_formats
from mvreg.plugins.pluggy_manager import GROUP, Manager
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
                f"{type(cause).__name__}: {cause}; install what it needs, or: {remove}"
            ) from cause
        manager.add(plugin, entry.name, origin)
    return manager


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
