"""`mvreg add`: what has come since is registered, what stands already stays."""

import numpy as np
import pytest

from mvreg.cli.main import main
from mvreg.report.json_file import load_report
from mvreg.testing import blob_scans


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scans").mkdir()
    for scan in blob_scans(5).scans[:4]:
        np.save(tmp_path / "scans" / f"{scan.name}.npy", scan.points)
    assert main(["dataset=folder", "dataset.path=scans", "rerun=false", "hydra.run.dir=first"]) == 0
    return tmp_path


def test_a_new_scan_costs_its_own_pairs(folder, capsys):
    before = load_report(folder / "first")
    new = blob_scans(5).scans[4]
    np.save(folder / "scans" / "new.npy", new.points)
    assert main(["add", "first", "hydra.run.dir=second"]) == 0
    after = load_report(folder / "second")
    assert set(after["poses"]) == {*before["poses"], "new.npy"}
    frame = np.array(after["poses"][before["reference"]])
    for name, pose in before["poses"].items():
        np.testing.assert_allclose(after["poses"][name], frame @ np.array(pose), atol=1e-9)
    assert {"new.npy"} <= {name for p in after["pairs"] for name in (p["source"], p["target"])}
    assert all("new.npy" in (p["source"], p["target"]) for p in after["pairs"])
    assert "keep their poses" in capsys.readouterr().err


def test_a_folder_that_is_no_run_is_refused(folder, capsys):
    assert main(["add", "scans"]) == 2
    assert "expected a run folder" in capsys.readouterr().err
