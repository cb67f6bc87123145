"""The plugin manager: finds plugins, collects their stages, passes events to observers.

A plugin is an entry point in the group ``mvreg``; whatever function of it is called ``mvreg_*`` is
a hook. The prefix is enough, the marker
`mvreg.plugins.hookspecs.hookimpl` is welcome: so a misspelt hook is noticed.
"""

from __future__ import annotations

import difflib
import inspect
import types
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING

import pluggy

from mvreg.errors import PluginError
from mvreg.plugins import hookspecs
from mvreg.plugins.registry import Registered, register_all

if TYPE_CHECKING:
    from mvreg.events import Event

GROUP = "mvreg"
#: Where plugins come from that no distribution brought, such as the observers of a run.
HERE = "this process"
HOOKS = ("mvreg_stages", "mvreg_config_path", "mvreg_event")


class ObserverWarning(RuntimeWarning):
    """An observer failed and was switched off; the run went on without it."""


class Manager(pluggy.PluginManager):
    """A pluggy manager for which the prefix ``mvreg_`` makes a hook.

    `origins` maps plugin names to the distributions they came with, ``"mvreg-fpfh 0.1.0"``;
    `muted` has the ids of observers that failed during this run.
    """

    def __init__(self) -> None:
        super().__init__(GROUP)
        self.add_hookspecs(hookspecs)
        self.origins: dict[str, str] = {}
        self.muted: set[int] = set()

    def parse_hookimpl_opts(self, plugin: object, name: str) -> pluggy.HookimplOpts | None:
        """Accept marked functions, and unmarked ones called ``mvreg_*``."""
        options = super().parse_hookimpl_opts(plugin, name)
        if options is not None or not name.startswith("mvreg_"):
            return options
        found = inspect.getattr_static(plugin, name, None)
        if not isinstance(
            found, types.FunctionType | types.MethodType | staticmethod | classmethod
        ):
            return None
        return {
            "wrapper": False, "hookwrapper": False, "optionalhook": False,
            "tryfirst": False, "trylast": False, "specname": None,
        }  # fmt: skip

    def add(self, plugin: object, name: str | None = None, origin: str = HERE) -> None:
        """Register a plugin, under a name of its own if none is given.

        Raises
        ------
        PluginError
            If the name is taken, a hook is misspelt or a hook has the wrong arguments.
        """
        name = name or f"{type(plugin).__module__}.{type(plugin).__qualname__}-{id(plugin)}"
        if self.has_plugin(name):
            other = self.origins.get(name, HERE)
            raise PluginError(
                f"two plugins are called {name!r}: one of {other}, one of {origin}; "
                "remove one of them"
            )
        try:
            self.register(plugin, name)
            self._refuse_unknown_hooks(plugin)
        except (pluggy.PluginValidationError, ValueError) as cause:
            if self.has_plugin(name):
                self.unregister(name=name)
            reason = " ".join(str(cause).split())
            raise PluginError(f"plugin {name!r} ({origin}) cannot be used: {reason}") from cause
        if origin != HERE:
            self.origins[name] = origin

    def _refuse_unknown_hooks(self, plugin: object) -> None:
        """Name a misspelt hook and the one it is nearest to."""
        try:
            self.check_pending()
        except pluggy.PluginValidationError as cause:
            unknown = sorted(
                name
                for name in dir(plugin)
                if self.parse_hookimpl_opts(plugin, name) and name not in HOOKS
            )
            if not unknown:
                raise
            near = difflib.get_close_matches(unknown[0], HOOKS, n=1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise pluggy.PluginValidationError(
                plugin, f"unknown hook {unknown[0]!r}; {hint}hooks: {', '.join(HOOKS)}"
            ) from cause


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
