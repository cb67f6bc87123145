"""Every stage of this repository's plugins stands under its kind's suite."""

import importlib.util
import sys
from pathlib import Path

import pytest

from mvreg.plugins import manager
from mvreg.testing import SUITES

ROOT = Path(__file__).resolve().parents[2]
OURS = ("comparators", "fpfh", "peers")
STAGES = {key: stage for key, stage in manager.stages().items() if stage.plugin in OURS}


def suites_in(file: Path, monkeypatch: pytest.MonkeyPatch) -> list[type]:
    """The test classes that a plugin's test file holds."""
    monkeypatch.syspath_prepend(str(file.parent))
    spec = importlib.util.spec_from_file_location(f"covered_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    return [v for k, v in vars(module).items() if k.startswith("Test") and isinstance(v, type)]


def test_every_stage_of_our_plugins_has_a_suite(monkeypatch: pytest.MonkeyPatch) -> None:
    files = sorted(ROOT.glob("plugins/*/tests/test_*.py"))
    found = [suite for file in files for suite in suites_in(file, monkeypatch)]
    covered = {
        key
        for key, stage in STAGES.items()
        for suite in found
        if issubclass(suite, SUITES[stage.kind])
        and isinstance(getattr(suite, "stage", None), stage.cls)
    }
    assert {stage.plugin for stage in STAGES.values()} == set(OURS)
    assert set(STAGES) - covered == set()
