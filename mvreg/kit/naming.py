"""What a new plugin may be called, and of which kinds there are."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from importlib.util import find_spec

from mvreg.config.presets import choices
from mvreg.contracts import KINDS
from mvreg.errors import InputError
from mvreg.export import table
from mvreg.plugins import manager

#: What a plugin may bring beside a stage.
BESIDES = ("reader", "exporter", "observer")
#: What people call kinds of ours, and what is meant.
MEANT = {
    "format": "reader", "export": "exporter", "writer": "exporter", "logger": "observer",
    "scans": "dataset", "data": "dataset", "icp": "refine", "descriptor": "describe",
    "matcher": "seed", "registration": "strategy", "filter": "downsample",
}  # fmt: skip
NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
LONGEST = 30


@dataclass(frozen=True)
class Naming:
    """The names of a new plugin: `name` of the entry point and the stage, of a `kind`."""

    name: str
    kind: str

    @property
    def distribution(self) -> str:
        """As pip knows it, ``mvreg-my-seed``."""
        return f"mvreg-{self.name.replace('_', '-')}"

    @property
    def package(self) -> str:
        """As Python imports it, ``mvreg_my_seed``."""
        return f"mvreg_{self.name}"

    @property
    def words(self) -> dict[str, str]:
        """What the names in a template become."""
        camel = "".join(part.capitalize() for part in self.name.split("_"))
        return {"Nameless": camel, "nameless": self.name, "NAMELESS": self.name.upper()}

    @property
    def cls(self) -> str:
        """The class of the stage, ``MySeedSeed``."""
        return self.words["Nameless"] + self.kind.title()

    def filled(self, template: str) -> str:
        """A template with the plugin's names in it."""
        for old, new in self.words.items():
            template = template.replace(old, new)
        return template


def checked_naming(name: str, kind: str) -> Naming:
    """The names of a new plugin.

    Raises
    ------
    InputError
        For what cannot be a name, is taken, or is no kind; says what would do.
    """
    kinds = (*KINDS, *BESIDES)
    if kind not in kinds:
        near = MEANT.get(kind) or next(iter(difflib.get_close_matches(kind, kinds, n=1)), "")
        hint = f"; did you mean {near!r}?" if near else ""
        raise InputError(
            f"{kind!r} is not a kind of plugin: expected one of {', '.join(kinds)}{hint}"
        )
    if not NAME.fullmatch(name):
        small = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
        hint = f", such as {small!r}" if NAME.fullmatch(small) else ""
        raise InputError(
            f"{name!r} cannot be the name of a plugin: expected small letters, digits and single "
            f"underscores, beginning with a letter{hint}"
        )
    if len(name) > LONGEST:
        raise InputError(f"{name!r}: expected a name of at most {LONGEST} letters, got {len(name)}")
    found = Naming(name, kind)
    refuse_taken(found)
    return found


def refuse_taken(naming: Naming) -> None:
    """Refuse a name that a stage, a preset or an installed package has.

    Raises
    ------
    InputError
        Says whose it is.
    """
    entry = manager.stages().get(f"{naming.kind}/{naming.name}")
    if entry is not None:
        raise InputError(
            f"{naming.kind}={naming.name} is taken by plugin {entry.plugin!r} ({entry.origin}); "
            "choose another name"
        )
    group = "dataset" if naming.kind == "dataset" else "method"
    if naming.kind in KINDS and naming.name in choices()[group]:
        raise InputError(f"there is a preset {group}={naming.name} already; choose another name")
    if naming.kind == "reader" and f".{naming.name}" in manager.formats():
        raise InputError(
            f"files ending in .{naming.name} are read already, as "
            f"{manager.formats()[f'.{naming.name}'].name}; choose another name, then change the "
            "suffix of your format if it is to take their place"
        )
    if naming.kind == "exporter" and naming.name in table.formats():
        raise InputError(f"there is an export format {naming.name!r} already; choose another name")
    in_use = manager.current()
    if in_use.has_plugin(naming.name):
        raise InputError(
            f"a plugin of {in_use.origin_of(naming.name)} is called {naming.name!r} "
            "already; choose another name"
        )
    if find_spec(naming.package) is not None:
        raise InputError(
            f"a package {naming.package} is installed already; choose another name, or: "
            f"pip uninstall {naming.distribution}"
        )
