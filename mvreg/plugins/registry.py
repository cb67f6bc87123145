"""The table of stages: what each plugin registers, checked before anything runs."""

from __future__ import annotations

import difflib
import inspect
import re
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from typing import TYPE_CHECKING

from mvreg.contracts import KINDS
from mvreg.errors import PluginError
from mvreg.plugins.signatures import misfit

if TYPE_CHECKING:
    from mvreg.plugins.pluggy_manager import Manager

# Hydra splits addresses at "/", and its command line at "=", "@", "," and blanks.
KEY = re.compile(r"([a-z][a-z0-9_]*)/([a-z][a-z0-9_]*)")
REQUIRED = "???"  # as Hydra writes it


@dataclass(frozen=True)
class Registered:
    """A stage in the table: `key` is its Hydra address, `plugin` and `origin` say whose it is."""

    key: str
    cls: type
    plugin: str
    origin: str

    @property
    def kind(self) -> str:
        """The group, ``refine``."""
        return self.key.partition("/")[0]

    @property
    def name(self) -> str:
        """The name within its kind, ``tricp``."""
        return self.key.partition("/")[2]

    @property
    def summary(self) -> str:
        """The first line of the docstring."""
        doc = (self.cls.__doc__ or "").strip()
        if not doc or doc.startswith(f"{self.cls.__name__}("):  # what dataclass() makes up
            return "(no description)"
        return doc.splitlines()[0]

    @property
    def parameters(self) -> dict[str, object]:
        """The parameters and their defaults; `REQUIRED` where there is none."""
        return {field.name: default(field) for field in fields(self.cls) if field.init}


def default(field: Field[object]) -> object:
    """A field's default value."""
    if field.default is not MISSING:
        return field.default
    return REQUIRED if field.default_factory is MISSING else field.default_factory()


def register_all(manager: Manager) -> dict[str, Registered]:
    """Collect the stages of every plugin, sorted by kind as in `KINDS`, then by name.

    Raises
    ------
    PluginError
        For an unknown kind, a key that two plugins register, or a value that is no stage; names
        the plugins and the key.
    """
    table: dict[str, Registered] = {}
    for answer in manager.answers("mvreg_stages"):
        who, given = answer.who, answer.value
        if not isinstance(given, dict):
            raise PluginError(
                f"{who}: expected mvreg_stages() to return a dict of kind/name to stage, "
                f"got {type(given).__name__}"
            )
        for key, cls in given.items():
            check(key, cls, who)
            if key in table:
                first = table[key]
                raise PluginError(
                    f"{key!r} is registered twice: by plugin {first.plugin!r} ({first.origin}) "
                    f"and by {who}; rename one of them or uninstall one of the plugins"
                )
            table[key] = Registered(key, cls, answer.plugin, answer.origin)
    order = list(KINDS)
    return {
        key: table[key]
        for key in sorted(table, key=lambda key: (order.index(table[key].kind), key))
    }


def check(key: object, cls: object, who: str) -> None:
    """Refuse what is not a stage, naming the plugin and the key."""
    match = KEY.fullmatch(key) if isinstance(key, str) else None
    if match is None:
        raise PluginError(
            f"{who}: {key!r} is not a key; expected kind/name in small letters, digits and _, "
            'such as "refine/tricp"'
        )
    if match[1] not in KINDS:
        near = difflib.get_close_matches(match[1], KINDS, n=1)
        hint = f"; did you mean '{near[0]}/{match[2]}'?" if near else ""
        raise PluginError(f"{who}: {key!r} has an unknown kind; kinds: {', '.join(KINDS)}{hint}")
    if not (isinstance(cls, type) and is_dataclass(cls)):
        raise PluginError(
            f"{who}: {key!r}: expected a frozen dataclass, got {cls!r}{_dataclass_advice(cls)}"
        )
    if not cls.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        raise PluginError(
            f"{who}: {key!r}: {cls.__qualname__} is not frozen; write @dataclass(frozen=True)"
        )
    if not any("__call__" in base.__dict__ for base in cls.__mro__):
        wanted = ", ".join(inspect.signature(KINDS[match[1]].__call__).parameters)
        raise PluginError(
            f"{who}: {key!r}: {cls.__qualname__} has no __call__; "
            f"mvreg.contracts.{KINDS[match[1]].__name__} says what it does: __call__({wanted})"
        )
    if wrong := misfit(match[1], cls):
        raise PluginError(
            f"{who}: {key!r} cannot be called as mvreg.contracts.{KINDS[match[1]].__name__} is: "
            f"{wrong}; change its parameters"
        )


def _dataclass_advice(given: object) -> str:
    """What to do about something that is no dataclass."""
    if isinstance(given, type):
        return f"; write @dataclass(frozen=True) above class {given.__qualname__}"
    if is_dataclass(given):
        return f"; register the class, {type(given).__qualname__}, not an object of it"
    return ""
