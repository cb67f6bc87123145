"""`mvreg export` and `export=`: a run folder in, files out, and clear errors."""

import json

import numpy as np
import pytest
from observed import run as observed_run

from mvreg.cli.main import main
from mvreg.errors import InputError
from mvreg.export.table import BY_NAME, formats_of
from mvreg.io import read_cloud
from mvreg.report.json_file import dumps

TINY = ["dataset=tiny", "dataset.views=3", "dataset.points=1500", "rerun=false"]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "result.json").write_text(dumps(observed_run()[-1].report))
    return tmp_path


def test_poses_need_no_more_than_the_report(folder, capsys):
    assert main(["export", str(folder), "tum", "4x4"]) == 0
    said = capsys.readouterr()
    report = json.loads((folder / "result.json").read_text())
    found = BY_NAME["matrices"].read(folder / "export")
    assert found.keys() == report["poses"].keys()
    for name, pose in found.items():
        assert (pose == np.array(report["poses"][name])).all()
    assert "without a pose are left out: c.ply" in said.err
    assert (folder / "export" / "tum_names.txt").exists()


def test_another_folder(folder, tmp_path):
    out = tmp_path / "else" / "where"
    assert main(["export", str(folder), "kitti", "--out", str(out)]) == 0
    assert (out / "kitti.txt").exists()
    assert not (folder / "export").exists()


def test_components_are_in_subfolders(folder):
    report = json.loads((folder / "result.json").read_text())
    report["unregistered"].remove("c.ply")
    component = {"number": 2, "reference": "c.ply", "poses": {"c.ply": np.eye(4).tolist()}}
    report["components"] = [component]
    (folder / "result.json").write_text(dumps(report))
    assert main(["export", str(folder), "matrix"]) == 0
    assert (folder / "export/component_2/matrix/c.txt").exists()
    assert not (folder / "export/matrix/c.txt").exists()


def test_points_without_a_configuration_are_refused(folder, capsys):
    assert main(["export", str(folder), "ply"]) == 2
    assert "which says where its scans are" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "part"),
    [(["RUN", "dxf"], "no format 'dxf'; formats: matrix"), (["nowhere", "tum"], "cannot read"),
     (["RUN"], "at least one format")],
)  # fmt: skip
def test_what_cannot_be_is_said(folder, words, part, capsys):
    assert main(["export", *(w.replace("RUN", str(folder)) for w in words)]) == 2
    assert part in capsys.readouterr().err


def test_the_list(capsys):
    assert main(["export", "--list"]) == 0
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert listed == [each for each in BY_NAME if each != "4x4"]


def test_no_format_twice():
    assert [each.name for each in formats_of(["4x4", "matrices", "TUM"])] == ["matrices", "tum"]
    with pytest.raises(InputError):
        formats_of(["tumm"])


def test_the_end_of_a_run_and_a_command_afterwards_write_the_same(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["dataset=tiny", "rerun=false", "report=false", "dataset.scramble=true"]
    assert main([*words, "export=[tum,ply]", "hydra.run.dir=now"]) == 0
    first = read_cloud(tmp_path / "now/export/model.ply")
    assert main(["export", "now", "tum", "ply", "--out", "later"]) == 0
    again = read_cloud(tmp_path / "later/model.ply")
    np.testing.assert_array_equal(again.points, first.points)
    assert first.attributes.keys() == again.attributes.keys() >= {"residual", "scan_index"}
    assert np.isfinite(again.attributes["residual"]).mean() > 0.5
    for name, values in again.attributes.items():
        np.testing.assert_array_equal(values, first.attributes[name])
    assert (tmp_path / "later/tum.txt").read_text() == (tmp_path / "now/export/tum.txt").read_text()
    (tmp_path / "now/.hydra/overrides.yaml").unlink()
    capsys.readouterr()
    assert main(["export", "now", "ply", "--out", "bare"]) == 0
    assert "without residuals: the scans cannot be prepared" in capsys.readouterr().err
    bare = read_cloud(tmp_path / "bare/model.ply")
    assert first.attributes.keys() - bare.attributes.keys() == {"residual"}


def test_poses_and_scans_in_their_own_frames_are_not_prepared(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([*TINY, "hydra.run.dir=now"]) in (0, 3)
    monkeypatch.setattr("mvreg.cli.export.views_again", None)
    assert main(["export", "now", "tum", "ptx"]) == 0
