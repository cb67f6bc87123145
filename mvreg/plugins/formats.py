"""The file formats that plugins bring, beside mvreg's own."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from mvreg.errors import MvregError, PluginError
from mvreg.io.cloud import PointCloud
from mvreg.io.formats import FORMATS, Format, ReadOptions, by_suffix
from mvreg.io.pieces import NotInPiecesError, Pieces
from mvreg.plugins.traced import raised
from mvreg.types.checks import shown

if TYPE_CHECKING:
    from mvreg.plugins.pluggy_manager import Manager

Item = TypeVar("Item", PointCloud, Pieces)


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
            known = Guarded(check(each, who), who).guarded()
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
    for name, reader in (("read", each.read), ("pieces", each.pieces)):
        if name == "pieces" and reader is None:
            continue
        try:
            inspect.signature(reader).bind("path", "options")  # type: ignore[arg-type]
        except (TypeError, ValueError):
            raise PluginError(
                f"{who}: format {each.name!r}: expected {name}(path, options), got {reader!r}; "
                "change its parameters"
            ) from None
    return each


@dataclass(frozen=True)
class Guarded:
    """The readers of a plugin's format, whose failures name the plugin.

    Raises
    ------
    PluginError
        From both readers, if one fails other than by mvreg's errors, those of files and of memory,
        or what it returns is something else.
    """

    format: Format
    who: str

    def guarded(self) -> Format:
        """The format with its readers guarded."""
        pieces = None if self.format.pieces is None else self.pieces
        return replace(self.format, read=self, pieces=pieces)

    def __call__(self, path: Path, options: ReadOptions) -> Iterator[PointCloud]:
        """The scans of a file."""
        wanted = "read(path, options) -> sequence of mvreg.io.PointCloud"
        read = self.format.read
        return self._each(path, lambda: read(path, options), PointCloud, wanted, read)

    def pieces(self, path: Path, options: ReadOptions) -> Iterator[Pieces]:
        """The scans of a file, each piece by piece."""
        wanted = "pieces(path, options) -> sequence of mvreg.io.pieces.Pieces"
        pieces = self.format.pieces
        assert pieces is not None
        for found in self._each(path, lambda: pieces(path, options), Pieces, wanted, pieces):
            found.read = self._clouds(found.read)
            yield found

    def _clouds(self, read: Callable[[Path], Iterator[PointCloud]]) -> Callable[..., Any]:
        wanted = "Pieces.read(path) -> iterator of mvreg.io.PointCloud"
        return lambda path: self._each(path, lambda: read(path), PointCloud, wanted, read)

    def _each(
        self, path: Path, call: Callable[[], Any], kind: type[Item], wanted: str, culprit: object
    ) -> Iterator[Item]:
        """What a call returns, one by one, each of which must be of a kind."""
        try:
            answer = call()
            if isinstance(answer, kind):
                raise self.error(path, wanted, f"got one {kind.__name__}; return it in a tuple")
            for each in answer:
                if not isinstance(each, kind):
                    raise self.error(path, wanted, f"got {shown(answer)}")
                yield each
        except (MvregError, NotInPiecesError, OSError, MemoryError, OverflowError):
            raise
        except Exception as cause:
            raise self.error(path, wanted, raised(cause, culprit, __file__)) from cause

    def error(self, path: Path, wanted: str, came: str) -> PluginError:
        """The error to raise: the file, whose format it is, what was expected and what came."""
        return PluginError(
            f"{path}: format {self.format.name!r} ({self.who}): expected {wanted}, or "
            f"mvreg.InputError for a damaged file; {came}"
        )
