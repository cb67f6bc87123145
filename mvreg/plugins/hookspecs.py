"""The six hooks that a plugin may implement, all optional.

A plugin is any object, usually a module, named by an entry point in the group ``mvreg``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pluggy

if TYPE_CHECKING:
    from mvreg.events import Event
    from mvreg.io import Format

hookspec = pluggy.HookspecMarker("mvreg")
#: Marks a method or function as an implementation of a hook below.
hookimpl = pluggy.HookimplMarker("mvreg")


@hookspec
def mvreg_stages() -> dict[str, type]:  # type: ignore[empty-body]
    """Return the stages: ``{"refine/tricp": TrimmedICP}``, kind and name to frozen dataclass."""


@hookspec
def mvreg_config_path() -> str:  # type: ignore[empty-body]
    """Return a Hydra search path with presets, ``"pkg://mvreg_comparators.conf"``."""


@hookspec
def mvreg_formats() -> list[Format]:  # type: ignore[empty-body]
    """Return file formats that the plugin reads; a suffix that another has is replaced."""


@hookspec
def mvreg_exports() -> list[Any]:  # type: ignore[empty-body]
    """Return formats that ``mvreg export`` writes, `mvreg.export.PoseFormat` or `PointFormat`.

    Their names have to be new ones: no format of mvreg is replaced.
    """


@hookspec
def mvreg_suites() -> dict[str, type]:  # type: ignore[empty-body]
    """Return contract suites of `mvreg.testing` for what the plain one does not suit.

    By their keys, ``{"describe/fpfh": FpfhSuite}``: subclasses that give a `stage` with other
    parameters than the defaults, or waive something. ``mvreg plugins check`` runs them. That of a
    format of `mvreg_exports` has the key ``export/NAME``, of one of `mvreg_formats`
    ``reader/NAME``; it gives the `format`.
    """


@hookspec
def mvreg_event(event: Event) -> None:
    """Observe one event of a run."""
