"""Where each file of the repository is on the site, and what its links become there.

The documents are written for a reader of the repository: their links lead to files. On the site a
link to a file with a page leads to that page; one to any other file becomes the file's name.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[2]
#: Files of the repository that have a page, and which: what ends in a slash is a folder. The first
#: that fits counts.
PAGES = (
    ("docs/sphinx/", None),
    ("docs/", ""),
    ("README.md", None),  # its reader is in the repository; a link to it leads to the first page
    ("mvreg/cli/listing.py", "reference/command_line.md"),
    ("conf/config.yaml", "reference/configuration.md"),
    ("mvreg/builtin.py", "reference/stages.md"),
    ("mvreg/README.md", "reference/map.md"),
    ("mvreg/API.md", "reference/api/index.md"),
    ("mvreg/GLOSSARY.md", "reference/glossary.md"),
    ("mvreg/io/README.md", "reference/formats_in.md"),
    ("mvreg/export/README.md", "reference/exports.md"),
    ("mvreg/report/SCHEMA.md", "reference/result_json.md"),
    ("plugins/README.md", "plugins/index.md"),
    ("plugins/mvreg-fpfh/README.md", "plugins/fpfh.md"),
    ("plugins/mvreg-comparators/README.md", "plugins/comparators.md"),
    ("plugins/mvreg-peers/README.md", "plugins/peers.md"),
    ("experiments/README.md", "benchmarks/experiments.md"),
    ("experiments/results/README.md", "benchmarks/results.md"),
    ("experiments/results/", "benchmarks/"),
    ("INSTALL.md", "install.md"),
    ("examples/README.md", "examples.md"),
    ("CHANGELOG.md", "changelog.md"),
    ("CONTRIBUTING.md", "contributing.md"),
    ("SECURITY.md", "security.md"),
)
#: Pages that are made while the site is built, by the file that documents link to instead.
MADE = ("mvreg/cli/listing.py", "conf/config.yaml", "mvreg/builtin.py", "mvreg/API.md")
KINDS = (".md", ".ipynb", ".png", ".svg")
FENCE = re.compile(r"^(```+|~~~+).*?^\1[ \t]*$", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"(!?)\[((?:[^][]|\[[^]]*\])*)\]\(([^)\s]+)\)")


def page_of(file: str) -> str | None:
    """The page of a file of the repository, both relative, or None where it has none."""
    if file == "README.md":
        return "index.md"
    for source, page in PAGES:
        if source.endswith("/") and file.startswith(source):
            return None if page is None else page + file.removeprefix(source)
        if file == source:
            return page
    return None


def sources() -> Iterator[Path]:
    """Every file that the site shows, in the order of `PAGES`, each once."""
    seen = set()
    for source, page in PAGES:
        path = ROOT / source
        found = sorted(path.rglob("*")) if source.endswith("/") else [path]
        for file in found:
            known = file in seen or page is None or source in MADE
            if not known and file.is_file() and file.suffix in KINDS:
                name = file.relative_to(ROOT).as_posix()
                if page_of(name) is not None:
                    seen.add(file)
                    yield file


def for_the_site(text: str, file: str) -> str:
    """A document as the site shows it.

    Parameters
    ----------
    text : str
        Markdown.
    file : str
        Where it is in the repository.

    Returns
    -------
    str
        The same with its links led to pages; code is left as it is.

    Raises
    ------
    FileNotFoundError
        If a link leads to a file that the repository does not have; names both.
    """
    parts, end = [], 0
    for block in FENCE.finditer(text):
        parts += [led(text[end : block.start()], file), block[0]]
        end = block.end()
    return "".join([*parts, led(text[end:], file)])


def led(text: str, file: str) -> str:
    """Text without blocks of code, its links led to pages."""
    page = page_of(file)
    assert page is not None

    def new(match: re.Match[str]) -> str:
        mark, words, target = match.groups()
        path, hash_, anchor = target.partition("#")
        if not path or re.match(r"[a-z]+:", target):
            return match[0]
        there = PurePosixPath(os.path.normpath(f"{PurePosixPath(file).parent}/{path}")).as_posix()
        if not (ROOT / there).exists():
            raise FileNotFoundError(f"{file} links to {target}: there is no {there}")
        aim = page_of(there) or page_of(f"{there}/README.md")
        if aim is None:
            named = words.strip("`") == there
            return f"`{there}`" if named else f"{words} (`{there}`)"
        if there == "mvreg/API.md" and (module := module_of(anchor)):
            aim, hash_, anchor = f"reference/api/{module}.md", "", ""
        way = os.path.relpath(aim, PurePosixPath(page).parent)
        return f"{mark}[{words}]({PurePosixPath(way)}{hash_}{anchor})"

    return LINK.sub(new, text)


def module_of(anchor: str) -> str | None:
    """The public module of a section of ``mvreg/API.md``, which has a page of its own."""
    text = (ROOT / "mvreg/API.md").read_text("utf-8")
    modules = re.findall(r"^## (.+)$", text, re.MULTILINE)
    return next((module for module in modules if module.replace(".", "") == anchor), None)
