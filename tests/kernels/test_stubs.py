"""The stubs of the kernels say what was compiled: names, parameters, defaults."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
KERNELS = ROOT / "mvreg" / "kernels"
#: What Cython adds; ``__cinit__`` has no signature while running: `test_the_stubs_of_classes` reads
#: the sources.
ADDED = r"""
mvreg\.kernels\.\w+\.__(test|pyx_capi)__
mvreg\.kernels\.\w+(\.\w+)?\.__(reduce|setstate)_cython__
mvreg\.kernels\.\w+\.\w+\.__init__
"""
#: For the module alone; that it is told of shows that what lacks a stub is found.
PRIVATE = ["mvreg.kernels.propagate.About is not present in stub"]


def test_stubs_agree_with_what_is_compiled(tmp_path):
    pytest.importorskip("mypy.stubtest")
    (tmp_path / "allowed").write_text(ADDED)
    found = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "mvreg.kernels", "--concise",
         "--ignore-disjoint-bases", "--mypy-config-file", "pyproject.toml",
         "--allowlist", str(tmp_path / "allowed")],
        cwd=ROOT, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert found.stdout.splitlines() == PRIVATE, found.stdout + found.stderr


def constructors_of_stub(text):
    """Parameters of each class's constructor, by its name."""
    return {
        each.name: [parameter.arg for parameter in made.args.args[1:]]
        for each in ast.parse(text).body if isinstance(each, ast.ClassDef)
        for made in each.body if isinstance(made, ast.FunctionDef) and made.name == "__init__"
    }  # fmt: skip


def constructors_of_source(text):
    """The same of a kernel's source; what ``__cinit__`` and ``__init__`` take."""
    found = {}
    for name, body in re.findall(
        r"^cdef class (\w+):\n(.*?)(?=^\S|\Z)", text, re.MULTILINE | re.DOTALL
    ):
        for words in re.findall(r"def __c?init__\(\s*self,\s*(.*?)\):", body, re.DOTALL):
            plain = re.sub(r" not None|\[[^]]*\]|\s*=[^,]*", "", words)
            parts = [part.split()[-1] for part in plain.split(",") if part.strip()]
            if parts != ["*_"]:
                found[name] = parts
    return found


@pytest.mark.parametrize("stub", sorted(KERNELS.glob("*.pyi")), ids=lambda file: file.stem)
def test_the_stubs_of_classes(stub):
    source = constructors_of_source(stub.with_suffix(".pyx").read_text())
    assert constructors_of_stub(stub.read_text()) == source


def test_a_wrong_constructor_would_be_found():
    words = "\n        self, points, double[:] b not None, c=1\n    "
    source = f"cdef class A:\n    def __cinit__({words}):\n"
    assert constructors_of_source(source) == {"A": ["points", "b", "c"]}
    stub = "class A:\n    def __init__(self, points: int, c: int = ...) -> None: ...\n"
    assert constructors_of_stub(stub) == {"A": ["points", "c"]}
