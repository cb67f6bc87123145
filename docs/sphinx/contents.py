"""The order of the site's pages: the navigation at its side."""

from __future__ import annotations

from collections.abc import Collection

#: Captions, and the pages below each; one that is not there, such as a notice that the repository
#: does not have, is left out.
CONTENTS = {
    "Start": ["start", "install", "first_steps", "scans", "runs", "methods"],
    "Guides": [
        "guides/turntable", "guides/rgbd", "guides/tls", "guides/lidar", "guides/meshes",
        "guides/mixture", "guides/not_placed", "scale",
    ],
    "How it works": ["method/overview", "method/search", "method/evidence", "method/graph",
                     "method/adjustment"],
    "Extending mvreg": ["tutorials/stage", "tutorials/sweep", "examples", "plugins/index"],
    "Benchmarks": ["benchmarks", "benchmarks/results", "benchmarks/experiments"],
    "Reference": [
        "reference/command_line", "reference/configuration", "reference/stages",
        "reference/formats_in", "reference/exports", "reference/result_json",
        "reference/api/index", "reference/glossary", "reference/map",
    ],
    "Project": ["changelog", "contributing", "security"],
}  # fmt: skip


def toctree(pages: Collection[str], caption: str = "", hidden: bool = True) -> str:
    """A table of contents for Sphinx, over pages by name and without their endings."""
    options = [f":caption: {caption}"] if caption else []
    options += [":hidden:"] if hidden else [":maxdepth: 1"]
    return "\n".join(["", "```{toctree}", *options, "", *(f"/{p}" for p in pages), "```", ""])


def with_contents(text: str, name: str, there: Collection[str]) -> str:
    """A page with what Sphinx is to know of the pages below it.

    Parameters
    ----------
    text : str
        The page.
    name : str
        Its name, without an ending.
    there : collection of str
        All the pages.
    """
    if name == "index":
        for caption, pages in CONTENTS.items():
            text += toctree([page for page in pages if page in there], caption)
    elif name in ("benchmarks/results", "plugins/index", "reference/api/index"):
        folder = name.rpartition("/")[0] + "/"
        placed = {page for pages in CONTENTS.values() for page in pages}
        below = [page for page in sorted(there) if page.startswith(folder) and page not in placed]
        text += toctree(below)
    return text
