"""Which room may import which: the contracts in ``pyproject.toml``, read by import-linter."""

import tomllib
from pathlib import Path

from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports

SETTINGS = Path(__file__).parents[2] / "pyproject.toml"


def test_imports_keep_to_the_contracts(monkeypatch, capsys):
    monkeypatch.chdir(SETTINGS.parent)
    answer = lint_imports(config_filename=str(SETTINGS), no_cache=True)
    assert answer == EXIT_STATUS_SUCCESS, capsys.readouterr().out


def test_every_room_has_a_layer():
    contracts = tomllib.loads(SETTINGS.read_text())["tool"]["importlinter"]["contracts"]
    layers = next(each for each in contracts if each["type"] == "layers")
    named = {name.strip() for layer in layers["layers"] for name in layer.split(":")}
    rooms = {each.stem for each in (SETTINGS.parent / "mvreg").iterdir()
             if each.suffix == ".py" or (each / "__init__.py").is_file()}  # fmt: skip
    assert rooms - {"__init__"} == named
