"""Links of a built site that lead nowhere: to no file, or to no such place in it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """What a page refers to, and the places in it that others may refer to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.foreign: list[str] = []
        self.places: set[str] = {"", "top"}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note targets and places."""
        for name, value in attrs:
            if name == "id" or (tag == "a" and name == "name"):
                self.places.add(value or "")
            elif name in ("href", "src") and value is not None:
                self.targets.append(value)
                loaded = name == "src" or (tag == "link" and ("rel", "stylesheet") in attrs)
                if loaded and urlsplit(value).netloc:
                    self.foreign.append(value)


@cache
def read(file: Path) -> Page:
    """A page as parsed."""
    return Page(file.read_text("utf-8"))


def broken(site: Path) -> list[tuple[str, str]]:
    """Pages and targets of the links of a site that lead nowhere; what has a scheme is not asked.

    Also what a page loads from elsewhere, such as a font: the site is to work without a network.
    """
    read.cache_clear()
    return [
        (file.relative_to(site).as_posix(), target)
        for file in sorted(site.rglob("*.html"))
        for target in missing(file)
    ]


def missing(file: Path) -> Iterator[str]:
    """The targets of one page that are not there."""
    yield from read(file).foreign
    for target in read(file).targets:
        parts = urlsplit(target)
        if parts.scheme or parts.netloc:
            continue
        there = file.parent / unquote(parts.path) if parts.path else file
        if not there.is_file():
            yield target
            continue
        if there.suffix == ".html" and unquote(parts.fragment) not in read(there).places:
            yield target
