"""`mvreg report`: the page of a run once more, and the judge of poses from elsewhere."""

from __future__ import annotations

import json

import numpy as np
import pytest

import mvreg
from mvreg.cli import main as cli
from mvreg.config.compose import compose
from mvreg.config.finished import put_back
from mvreg.report.json_file import load_report


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    words = ["dataset=tiny", "dataset.views=3", "rerun=false", f"hydra.run.dir={folder}"]
    assert cli.main(words) == 0
    return folder


@pytest.fixture
def scans(tmp_path):
    """A folder of scans, and their poses in another frame."""
    found = mvreg.dataset("tiny", views=4, scramble=True)
    (tmp_path / "scans").mkdir()
    for scan in found.scans:
        np.save(tmp_path / "scans" / f"{scan.name}.npy", scan.points)
    return tmp_path / "scans", {name: pose.tolist() for name, pose in found.poses.items()}


def kept(path, poses):
    path.write_text(json.dumps(poses))
    return path


def test_the_page_of_a_run_is_made_again(run, capsys):
    page = run / "report.html"
    before = page.read_text(encoding="utf-8")
    page.unlink()
    assert cli.main(["report", str(run)]) == 0
    assert capsys.readouterr().out == f"{page}\n"
    assert page.read_text(encoding="utf-8") == before


def test_a_run_is_made_again_from_another_folder(scans, tmp_path, monkeypatch, capsys):
    """Its configuration names files from where it ran, and an infinity, which JSON has not."""
    monkeypatch.chdir(scans[0].parent)
    words = ["propagate=consensus", "dataset=folder", "dataset.path=scans", "rerun=false"]
    assert cli.main([*words, "dataset.most_points=4000", "hydra.run.dir=run"]) == 0
    page, said = tmp_path / "run" / "report.html", load_report(tmp_path / "run")
    assert said["config"]["propagate"]["slide"] is None
    before = page.read_text(encoding="utf-8")
    page.unlink()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert cli.main(["report", "../run"]) == 0
    assert page.read_text(encoding="utf-8") == before
    assert cli.main(["export", "../run", "ply"]) == 0
    assert (tmp_path / "run" / "export").is_dir()
    assert not list((tmp_path / "elsewhere").iterdir())


def test_what_was_set_in_place_of_an_infinity_is_put_back(tmp_path):
    config = compose(["+method=fcpma", "propagate.slide=3.0"])
    put_back(config, {"propagate": {"slide": None, "samples": 7}}, tmp_path)
    assert (config.propagate.slide, config.propagate.samples) == (3.0, 7)
    levels = [{"judge.min_overlap": None, "propagate.keep": 2}, *config.strategy.levels[1:]]
    put_back(config, {"strategy": {"levels": levels}}, tmp_path)
    assert config.strategy.levels[0] == {"judge.min_overlap": 0.6, "propagate.keep": 2}


def test_a_run_without_its_configuration_or_scans_says_so(run, tmp_path, capsys):
    assert cli.main(["report", str(tmp_path)]) == 2
    said = json.loads((run / "result.json").read_text())
    kept(tmp_path / "result.json", said)
    assert cli.main(["report", str(tmp_path)]) == 2
    assert "expected .hydra/overrides.yaml" in capsys.readouterr().err
    (tmp_path / ".hydra").mkdir()
    (tmp_path / ".hydra" / "overrides.yaml").write_text("[dataset=tiny]\n")
    kept(tmp_path / "result.json", {**said, "scans": said["scans"][1:]})
    assert cli.main(["report", str(tmp_path)]) == 2
    assert "did the data set change since" in capsys.readouterr().err
    kept(tmp_path / "result.json", {**said, "config": {"dataset": {"height": 1}}})
    assert cli.main(["report", str(tmp_path)]) == 2
    assert "not one of this version" in capsys.readouterr().err
    assert cli.main(["report", str(run), "--out", str(tmp_path)]) == 2
    assert "go with --poses" in capsys.readouterr().err


def test_given_poses_are_judged(scans, tmp_path, capsys):
    folder, poses = scans
    *_, last = poses
    file = kept(tmp_path / "poses.json", {n: p for n, p in poses.items() if n != last})
    out = tmp_path / "out"
    arguments = ["report", "--poses", str(file), str(folder), "dataset.unit=mm"]
    assert cli.main([*arguments, "--out", str(out)]) == 3
    assert "placed 3 of 4 scans" in capsys.readouterr().out
    found = load_report(out)
    assert found["unregistered"] == [f"{last}.npy"] and found["method"] == "given"
    assert found["unit"] == "mm" and found["poses"][found["reference"]] == np.eye(4).tolist()
    grades = {row["name"]: row["assessment"]["grade"] for row in found["scans"][:3]}
    assert set(grades.values()) == {"green"}
    assert (out / "model.ply").is_file() and (out / "report.html").is_file()
    assert cli.main(["report", str(out)]) == 0  # and the page of this once more


def test_a_wrong_pose_is_told(scans, tmp_path):
    folder, poses = scans
    name = list(poses)[2]
    wrong = np.array(poses[name]) @ np.diag([-1.0, -1, 1, 1])
    wrong[:3, 3] += 5
    file = kept(tmp_path / "poses.json", {**poses, name: wrong.tolist()})
    assert cli.main(["report", "--poses", str(file), str(folder), "--out", str(tmp_path)]) == 0
    rows = {row["name"]: row for row in load_report(tmp_path)["scans"]}
    assert rows.pop(f"{name}.npy")["assessment"]["grade"] == "red"


def test_poses_of_other_scans_are_refused(scans, tmp_path, capsys):
    folder, _ = scans
    file = kept(tmp_path / "poses.json", {"elsewhere": np.eye(4).tolist()})
    assert cli.main(["report", "--poses", str(file), str(folder)]) == 2
    assert "scans and poses go together by file name" in capsys.readouterr().err
    assert cli.main(["report", "--poses", str(file)]) == 2
    assert "expected the folder of the scans" in capsys.readouterr().err
