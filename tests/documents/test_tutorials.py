"""The tutorials' distributions are whole, and their own tests pass."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

TUTORIALS = sorted((Path(__file__).parents[2] / "docs" / "tutorials").glob("*/pyproject.toml"))


@pytest.mark.parametrize("file", TUTORIALS, ids=lambda file: file.parent.name)
def test_a_distribution_names_a_module_of_its_own(file):
    project = tomllib.loads(file.read_text())["project"]
    assert project["name"] == file.parent.name
    for module in project["entry-points"]["mvreg"].values():
        assert (file.parent / f"{module}.py").is_file()


@pytest.mark.parametrize("file", TUTORIALS, ids=lambda file: file.parent.name)
def test_its_tests_pass(file, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:dash",
         f"--rootdir={file.parent}", "-o", "pythonpath=.", "-c", str(file),
         str(file.parent / "tests")],
        cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    assert " passed" in done.stdout
