"""The pluggy manager for which the prefix ``mvreg_`` makes a hook."""

from __future__ import annotations

import difflib
import inspect
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import pluggy

from mvreg.errors import PluginError
from mvreg.plugins import hookspecs

GROUP = "mvreg"
#: Where plugins come from that no distribution brought, such as the observers of a run.
HERE = "this process"
HOOKS = (
    "mvreg_stages", "mvreg_config_path", "mvreg_formats", "mvreg_exports", "mvreg_suites",
    "mvreg_event",
)  # fmt: skip


@dataclass(frozen=True)
class Answer:
    """What a plugin returned from a hook; `plugin` and `origin` say whose it is."""

    plugin: str
    origin: str
    value: Any

    @property
    def who(self) -> str:
        """The plugin, for messages."""
        return f"plugin {self.plugin!r} ({self.origin})"


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
            raise PluginError(
                f"two plugins are called {name!r}: one of {self.origin_of(name)}, one of {origin}; "
                "remove one of them"
            )
        try:
            self.register(plugin, name)
            self._refuse_unknown_hooks(plugin)
        except (pluggy.PluginValidationError, ValueError) as cause:
            if self.has_plugin(name):
                self.unregister(name=name)
            reason = _wrong_arguments(plugin) or " ".join(str(cause).split())
            raise PluginError(f"plugin {name!r} ({origin}) cannot be used: {reason}") from cause
        if origin != HERE:
            self.origins[name] = origin

    def origin_of(self, name: str) -> str:
        """The distribution that a plugin came with, or `HERE`."""
        return self.origins.get(name, HERE)

    def answers(
        self, hook: str, taken_as: Callable[[Any], Any] = lambda value: value
    ) -> Iterator[Answer]:
        """What each plugin returns from a hook without arguments.

        Parameters
        ----------
        hook : str
            Its name.
        taken_as : callable
            Makes of what is returned what is wanted; its errors are the plugin's.

        Raises
        ------
        PluginError
            If a plugin fails; names it.
        """
        for impl in getattr(self.hook, hook).get_hookimpls():
            found = Answer(impl.plugin_name, self.origin_of(impl.plugin_name), None)
            try:
                value = taken_as(impl.function())
            except Exception as cause:
                raise PluginError(
                    f"{found.who} failed in {hook}(): {type(cause).__name__}: {cause}"
                ) from cause
            yield replace(found, value=value)

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
            near = difflib.get_close_matches(unknown[0], HOOKS, n=1, cutoff=0.75)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise pluggy.PluginValidationError(
                plugin, f"unknown hook {unknown[0]!r}; {hint}hooks: {', '.join(HOOKS)}"
            ) from cause


def _wrong_arguments(plugin: object) -> str | None:
    """The first hook of a plugin that asks for what it is not given, in words."""
    for name in HOOKS:
        function = getattr(plugin, name, None)
        if not callable(function):
            continue
        wanted = list(inspect.signature(getattr(hookspecs, name)).parameters)
        found = list(inspect.signature(function).parameters)
        if set(found) - set(wanted):
            return f"expected {name}({', '.join(wanted)}), got {name}({', '.join(found)})"
    return None
