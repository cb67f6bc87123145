"""The formats that plugins bring, beside mvreg's own."""

from __future__ import annotations

import inspect
import re
from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from mvreg.errors import MvregError, PluginError
from mvreg.export.formats import Format, PointFormat, PoseFormat
from mvreg.plugins.traced import raised
from mvreg.types.checks import shown

if TYPE_CHECKING:
    from mvreg.plugins.pluggy_manager import Manager

NAME = re.compile(r"[a-z][a-z0-9_]*")


def collect_exports(manager: Manager, taken: Collection[str] = ()) -> dict[str, Format]:
    """The export formats of every plugin by name, each ready to be called.

    Parameters
    ----------
    manager : Manager
        Of the plugins.
    taken : collection of str
        Names that mvreg's own formats have.

    Raises
    ------
    PluginError
        If a hook fails, returns what are no formats, or takes a name that another format has.
    """
    found: dict[str, Format] = {}
    owners: dict[str, str] = {}
    for answer in manager.answers("mvreg_exports", taken_as=list):
        who = answer.who
        for each in answer.value:
            known: Any = check(each, who)
            owner = owners.get(known.name, "mvreg" if known.name in taken else "")
            if owner:
                raise PluginError(
                    f"the export format {known.name!r} is registered twice: by {owner} and by "
                    f"{who}; rename one of them or uninstall one of the plugins"
                )
            owners[known.name] = who
            found[known.name] = replace(known, write=Guarded(known, who))
    return found


def check(each: object, who: str) -> Format:
    """Refuse what is no format, naming the plugin."""
    if not isinstance(each, PoseFormat | PointFormat):
        raise PluginError(
            f"{who}: expected mvreg_exports() to return mvreg.export.PoseFormat or PointFormat, "
            f"got {shown(each)}"
        )
    if not (isinstance(each.name, str) and NAME.fullmatch(each.name)):
        raise PluginError(
            f"{who}: export format {each.name!r}: expected a name in small letters, digits and _, "
            "such as 'tum'"
        )
    for field in ("files", "summary"):
        text = getattr(each, field)
        if not (isinstance(text, str) and text.strip() and text.isprintable()):
            raise PluginError(
                f"{who}: export format {each.name!r}: expected {field} in one line, which "
                f"mvreg export --list shows, got {text!r}"
            )
    try:
        inspect.signature(each.write).bind(*arguments(each))
    except (TypeError, ValueError):
        raise PluginError(
            f"{who}: export format {each.name!r}: expected {wanted(each)}, got {each.write!r}; "
            "change its parameters"
        ) from None
    return each


def arguments(each: Format) -> tuple[str, ...]:
    """The names of what a format's ``write`` is given."""
    return ("folder", "model") if isinstance(each, PointFormat) else (
        "folder", "component", "placements"
    )  # fmt: skip


def wanted(each: Format) -> str:
    """How a format's ``write`` is called, in words."""
    return f"write({', '.join(arguments(each))}) -> list of str"


@dataclass(frozen=True)
class Guarded:
    """The ``write`` of a plugin's format, whose failures name the plugin."""

    format: Format
    who: str

    def __call__(self, *given: Any) -> list[str]:
        """Write, and check what comes back.

        Raises
        ------
        PluginError
            If the writer fails other than by mvreg's errors or those of files, or returns no
            list of remarks.
        """
        write: Any = self.format.write
        try:
            said = write(*given)
        except (MvregError, OSError):
            raise
        except Exception as cause:
            raise self.error(raised(cause, write, __file__)) from cause
        if not isinstance(said, list) or not all(isinstance(each, str) for each in said):
            raise self.error(f"got {shown(said)}; return [] where there is nothing to say")
        return said

    def error(self, came: str) -> PluginError:
        """The error to raise: whose format it is, what was expected and what came."""
        return PluginError(
            f"export={self.format.name} ({self.who}): expected {wanted(self.format)}: remarks, "
            f"having written {self.format.files}; {came}"
        )
