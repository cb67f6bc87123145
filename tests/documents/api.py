"""What is public, and the page that lists it: ``make include`` writes `mvreg/API.md` anew."""

import inspect
from importlib import import_module
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "mvreg" / "API.md"
#: The modules that plugins and programs may import; their `__all__` says which names.
PUBLIC = (
    "mvreg", "mvreg.types", "mvreg.contracts", "mvreg.errors", "mvreg.events", "mvreg.geometry",
    "mvreg.geometry.se3", "mvreg.geometry.nearest", "mvreg.surface", "mvreg.stages",
    "mvreg.io", "mvreg.export", "mvreg.execution", "mvreg.tbb", "mvreg.testing",
)  # fmt: skip
#: What has no docstring of its own.
VALUES = {
    "__version__": "The version that is installed, as `mvreg --version` has it.",
    "Array": "Array of float64.",
    "Emit": "A function that takes an event.",
    "Event": "Any of the events.",
    "FORMATS": "The formats that come with mvreg.",
    "Flags": "Array of truth values.",
    "Indices": "Array of integers that index others.",
    "KINDS": "The protocol of each kind of stage, by its name in the configuration.",
    "Pieces": "The points of a file and their attributes, some at a time.",
    "PointLike": "Whatever looks like points (N, 3): arrays, tables, tensors, clouds, meshes.",
    "READERS": "What reads a file of each suffix.",
    "SUITES": "The contract suite of each kind of stage.",
    "SUPPORTED": "The suffixes of files that can be read.",
    "Scans": "What `mvreg.register` takes: a set, a sequence of scans, a mapping of names to them.",
    "hookimpl": "Marks a method or function as an implementation of a plugin's hook.",
}
HEAD = """# What is public

Plugins and programs import from these modules, and from no other: all else may change from one
version to the next. `make include` writes this page from the docstrings.
"""


def summary(name: str, value: object) -> str:
    """The first paragraph of a docstring, in one line."""
    text = VALUES.get(name) or inspect.getdoc(value) or ""
    return " ".join(text.split("\n\n")[0].split())


def names(module: ModuleType) -> list[str]:
    """The public names of a module."""
    return list(module.__all__)


def page() -> str:
    """The page as it should be."""
    found = [HEAD]
    for path in PUBLIC:
        module = import_module(path)
        lines = [f"- `{name}`: {summary(name, getattr(module, name))}" for name in names(module)]
        found.append(f"## {path}\n\n{summary(path, module)}\n\n" + "\n".join(lines) + "\n")
    return "\n".join(found)


if __name__ == "__main__":
    PAGE.write_text(page())
