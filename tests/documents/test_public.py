"""What is public is listed, documented, and all that plugins use."""

import ast
import inspect
import re
import subprocess
import sys
from importlib import import_module

import pytest
from api import PAGE, PUBLIC, ROOT, VALUES, names, page, summary

SOURCES = sorted(
    file for file in (ROOT / "plugins").rglob("*.py")
    if "tests" not in file.parts and not file.name.startswith("test_")
)  # fmt: skip


def imports(source: str) -> set[str]:
    """Dotted names of all that a source takes from mvreg: ``mvreg.types.View``."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return {name for name in found if name.split(".")[0] == "mvreg"}


def private(source: str) -> set[str]:
    """What a source takes from mvreg and is not public."""
    public = {f"{path}.{name}" for path in PUBLIC for name in names(import_module(path))}
    return imports(source) - public - set(PUBLIC)


def test_a_private_import_is_found():
    source = "import mvreg.run\nfrom mvreg.types import View\ndef f():\n from mvreg.fit import a"
    assert private(source) == {"mvreg.run", "mvreg.fit.a"}
    assert private("from mvreg.types.view import View") == {"mvreg.types.view.View"}


@pytest.mark.parametrize("file", SOURCES, ids=lambda file: file.stem)
def test_plugins_import_what_is_public(file):
    assert not private(file.read_text())


def test_the_page_lists_what_is_public():
    text = PAGE.read_text()
    sections = {
        path: re.findall(r"^- `(\w+)`: \S", body, re.MULTILINE)
        for path, body in re.findall(r"^## (\S+)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    }
    assert sections == {path: names(import_module(path)) for path in PUBLIC}
    assert text == page(), "run `make include`"


@pytest.mark.parametrize("path", PUBLIC)
def test_every_public_name_is_documented(path):
    module = import_module(path)
    assert module.__doc__
    for name in names(module):
        value = getattr(module, name)
        text = summary(name, value)
        assert text.endswith((".", ":")), f"{path}.{name}: {text!r}"
        assert not text.startswith(f"{name}("), f"{path}.{name}: dataclasses' own docstring"
        if inspect.isfunction(value) and name not in VALUES:
            check_shapes(f"{path}.{name}", value)


def check_shapes(name, function):
    """A function that takes or gives arrays says their shapes."""
    if any("Array" in str(each) or "Indices" in str(each) for each in
           function.__annotations__.values()):  # fmt: skip
        assert re.search(r"\((\.\.\.|[A-Z4-9\d]+),", function.__doc__), f"{name}: no shape"


@pytest.mark.parametrize("path", ["mvreg", "mvreg.surface", "mvreg.stages"])
def test_names_are_looked_up_late(path):
    code = f"import sys, {path}; print({{'numpy', 'scipy', 'open3d', 'rerun'}} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = import_module(path).nothing
