"""The file formats that plugins bring, beside mvreg's own."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mvreg.errors import MvregError, PluginError
from mvreg.io.cloud import PointCloud
from mvreg.io.formats import FORMATS, Format, ReadOptions, by_suffix
from mvreg.plugins.traced import raised
from mvreg.types.checks import shown

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
            known = replace(check(each, who), read=Guarded(each, who))
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
    try:
        inspect.signature(each.read).bind("path", "options")
    except (TypeError, ValueError):
        raise PluginError(
            f"{who}: format {each.name!r}: expected read(path, options), got {each.read!r}; change "
            "its parameters"
        ) from None
    return each


@dataclass(frozen=True)
class Guarded:
    """The reader of a plugin's format, whose failures name the plugin."""

    format: Format
    who: str

    def __call__(self, path: Path, options: ReadOptions) -> Iterator[PointCloud]:
        """The scans of a file.

        Raises
        ------
        PluginError
            If the reader fails other than by mvreg's errors, those of files and of memory, or what
            it returns are no clouds.
        """
        read = self.format.read
        try:
            answer: Any = read(path, options)
            if isinstance(answer, PointCloud):
                raise self.error(path, "got one PointCloud; return it in a tuple")
            for cloud in answer:
                if not isinstance(cloud, PointCloud):
                    raise self.error(path, f"got {shown(answer)}")
                yield cloud
        except (MvregError, OSError, MemoryError, OverflowError):
            raise
        except Exception as cause:
            raise self.error(path, raised(cause, read, __file__)) from cause

    def error(self, path: Path, came: str) -> PluginError:
        """The error to raise: the file, whose format it is, what was expected and what came."""
        return PluginError(
            f"{path}: format {self.format.name!r} ({self.who}): expected read(path, options) -> "
            f"sequence of mvreg.io.PointCloud, or mvreg.InputError for a damaged file; {came}"
        )
