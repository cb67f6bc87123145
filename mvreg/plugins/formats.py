"""The file formats that plugins bring, beside mvreg's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mvreg.errors import PluginError
from mvreg.io.formats import FORMATS, Format, by_suffix

if TYPE_CHECKING:
    from mvreg.plugins.pluggy_manager import Manager


def collect_formats(manager: Manager) -> dict[str, Format]:
    """The formats of mvreg and of every plugin by suffix; a plugin's replaces mvreg's.

    Raises
    ------
    PluginError
        If a hook fails, returns what are no formats, or takes a suffix that another plugin has.
    """
    found = by_suffix(FORMATS)
    owners: dict[str, str] = {}
    for answer in manager.answers("mvreg_formats", taken_as=list):
        who = answer.who
        for each in answer.value:
            known = check(each, who)
            for suffix in known.suffixes:
                if suffix in owners:
                    raise PluginError(
                        f"the suffix {suffix!r} is registered twice: by {owners[suffix]} and by "
                        f"{who}; uninstall one of the plugins"
                    )
                owners[suffix] = who
                found[suffix] = known
    return found


def check(each: object, who: str) -> Format:
    """Refuse what is no format, naming the plugin."""
    if not isinstance(each, Format):
        raise PluginError(
            f"{who}: expected mvreg_formats() to return mvreg.io.Format, got {type(each).__name__}"
        )
    bad = [s for s in each.suffixes if not (s.startswith(".") and s == s.lower() and len(s) > 1)]
    if bad or not each.suffixes:
        raise PluginError(
            f"{who}: format {each.name!r}: expected suffixes in lower case with a point, such as "
            f"'.ptx'; got {bad or 'none'}"
        )
    return each
