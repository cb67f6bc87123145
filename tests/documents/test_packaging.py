"""What is installed: every package, every preset, every plugin's module."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PLUGINS = sorted((ROOT / "plugins").glob("*/pyproject.toml"))


def packages_in(folder: Path, name: str) -> set[str]:
    """Dotted names of the packages in a folder that is one itself."""
    inner = [file.parent.relative_to(folder) for file in folder.rglob("__init__.py")]
    return {".".join([name, *path.parts]) for path in inner}


def test_every_package_is_installed():
    found = packages_in(ROOT / "mvreg", "mvreg") | packages_in(ROOT / "conf", "mvreg.conf")
    assert set(PROJECT["tool"]["setuptools"]["packages"]) == found


def test_every_preset_is_installed():
    data = PROJECT["tool"]["setuptools"]["package-data"]
    for file in (ROOT / "conf").rglob("*.yaml"):
        package = ".".join(["mvreg.conf", *file.parent.relative_to(ROOT / "conf").parts])
        assert data.get(package) == ["*.yaml"], (
            f"{file}: its folder needs an __init__.py and a line"
        )


def test_the_licence_is_the_one_named():
    assert PROJECT["project"]["license"] == "Apache-2.0"
    text = (ROOT / "LICENSE").read_text()
    assert "Apache License" in text and "END OF TERMS AND CONDITIONS" in text


@pytest.mark.parametrize("file", PLUGINS, ids=lambda file: file.parent.name)
def test_a_plugin_is_a_whole_distribution(file):
    project = tomllib.loads(file.read_text())["project"]
    assert project["name"] == file.parent.name
    assert any(re.match(r"mvreg\b", need) for need in project["dependencies"])
    assert project["requires-python"] == PROJECT["project"]["requires-python"]
    assert (file.parent / project["readme"]).is_file()
    for module in project["entry-points"]["mvreg"].values():
        top = file.parent / module.partition(".")[0]
        assert top.is_dir() or top.with_suffix(".py").is_file()
    assert any((file.parent / "tests").glob("test_*.py"))
