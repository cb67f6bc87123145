"""The schema of a report: written down as it is, and old reports in its words."""

import json
import re
from collections.abc import Iterator
from dataclasses import asdict
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from observed import apart

import mvreg
from mvreg.cli import main as cli
from mvreg.io import PointCloud
from mvreg.io.ply_write import write_ply_clouds
from mvreg.observers.recorder import COLUMNS
from mvreg.report import upgrade
from mvreg.report.json_file import load_report
from mvreg.report.table import render
from mvreg.types import Pattern, ScanScale

OLD = Path(__file__).with_name("schema_2.json")
DOCUMENT = Path(upgrade.__file__).with_name("SCHEMA.md").read_text(encoding="utf-8")
#: Mappings whose keys are names, and what is written in one line whatever is below it.
BY_NAME = re.compile(
    r"^(components\[\]\.)?(poses|seconds|covariances|truth|objects|motions|config|versions)\.[^\n]*"
)
SCANS = re.compile(r"errors\.scans\.[^\n]*\.(?=\w+$)")
MATRIX = re.compile(r"(\[\])+$")


def documented(table: str) -> set[str]:
    """The keys in the first column of the table that follows a heading row."""
    rows = DOCUMENT.partition(f"| {table} |")[2].partition("\n\n")[0]
    return set(re.findall(r"`([^`]+)`", "".join(re.findall(r"^\|([^|]*)\|", rows, re.MULTILINE))))


def paths(value: object, prefix: str = "") -> Iterator[str]:
    """Every path of a report down to its numbers and strings."""
    if isinstance(value, dict) and value:
        for key, item in value.items():
            yield from paths(item, f"{prefix}.{key}" if prefix else key)
    elif isinstance(value, list) and value:
        for item in value:
            yield from paths(item, f"{prefix}[]")
    elif value is not None and value not in ({}, []):
        yield prefix


def general(path: str) -> str:
    """A path with names replaced by ``*``; the entries of a matrix are no keys."""
    found = BY_NAME.match(path)
    if found:
        return f"{found[1] or ''}{found[2]}.*"
    path = SCANS.sub("errors.scans.*.", path)
    return MATRIX.sub("[]", path)


@cache
def found_in_reports() -> frozenset[str]:
    """The paths of reports: of two real runs, and of one with everything that can be in one."""
    folder = Path(found_in_reports.folder)
    arguments = ["dataset=mixture", "dataset.of=['tiny views=3']", "dataset.scramble=true", "rng=0"]
    assert cli.main([*arguments, "rerun=false", f"hydra.run.dir={folder}"]) == 0
    real = load_report(folder)
    scans = folder / "scans"
    for index, scan in enumerate(mvreg.dataset("tiny", views=3).scans):
        points = scan.points / (1000 if index else 1)
        cloud = PointCloud(points, attributes={"intensity": points[:, 0]})
        write_ply_clouds(scans / f"{index}.ply", [cloud], {"intensity": np.dtype(float)})
    (scans / "notes.txt").write_text("on a turntable")
    arguments = ["dataset=folder", f"dataset.path={scans}", "rerun=false"]
    assert cli.main([*arguments, f"hydra.run.dir={folder}/other"]) == cli.NOT_PLACED
    read = load_report(folder / "other")
    made = apart()[-1].report
    made["patterns"] = [asdict(Pattern("a.ply", "scale", 3e-4, 1e-5))]
    made["scales"] = [asdict(ScanScale("a.ply", 1.0003, 1e-5))]
    made["pairs"] = [{**pair, "evidence": {}} for pair in made["pairs"]]
    (told,) = [row["answers"] for row in made["scans"] if row["answers"]]
    made["components"][0]["answers"] = told
    return frozenset(general(path) for report in (real, read, made) for path in paths(report))


def test_every_key_of_a_report_is_written_down_and_none_besides(tmp_path, monkeypatch):
    monkeypatch.setattr(found_in_reports, "folder", tmp_path / "run", raising=False)
    real, written = found_in_reports(), documented("key")
    optional = {"commit", "model_points", "pairs[].evidence.loop_probability"}
    assert real - written == set(), "write these down in mvreg/report/SCHEMA.md"
    assert written - real - optional == set(), "no report has these"


def test_the_columns_of_pairs_csv_are_written_down():
    assert documented("column") == set(COLUMNS)


def test_the_document_names_its_schema():
    assert f"schema {upgrade.SCHEMA}," in DOCUMENT.splitlines()[0]
    assert f"| `schema` | integer | | {upgrade.SCHEMA} |" in DOCUMENT


def old() -> dict:
    return json.loads(OLD.read_text(encoding="utf-8"))


@pytest.mark.parametrize("schema", [1, 2])
def test_a_report_of_an_old_schema_says_the_same_in_new_words(tmp_path, schema):
    before = {**old(), "schema": schema}
    (tmp_path / "result.json").write_text(json.dumps(before))
    found = load_report(tmp_path)
    assert found["schema"] == upgrade.SCHEMA
    written = documented("key")
    assert {general(path) for path in paths(found)} <= written
    assert not {general(path) for path in paths(before)} <= written, "the old words are others"
    for row, past in zip(found["scans"], before["scans"], strict=True):
        now, was = row["assessment"], past["assessment"]
        assert (now["coverage"], now["inlier_ratio"], now["strength"]) == (
            was["overlap"], was["within"], was["balance"],
        )  # fmt: skip
        assert row["overlap"] == past["overlap"], "xi keeps its name"
    for row, past in zip(found["links"], before["links"], strict=True):
        assert row["contact_ratio"] == past["overlap"]
    for row, past in zip(found["pairs"], before["pairs"], strict=True):
        now, was = row["evidence"], past["evidence"]
        assert (now["surface_overlap"], now["localizability"], now["residual_step"]) == (
            was["overlap"], was["stability"], was["pull"],
        )  # fmt: skip
    assert found["grades"]["inlier_ratio"] == before["grades"]["within"]
    assert found["config"]["judge"]["max_alternative"] == before["config"]["judge"]["max_rival"]
    assert found["config"]["strategy"]["max_failures"] == before["config"]["strategy"]["patience"]
    np.testing.assert_array_equal(
        [found["poses"][name] for name in found["poses"]],
        [before["poses"][name] for name in found["poses"]],
    )


def test_what_is_upgraded_is_not_changed_in_place():
    before = old()
    upgrade.upgraded(before)
    assert before == old()


def test_a_report_of_the_present_schema_stays_as_it_is():
    report = apart()[-1].report
    assert upgrade.upgraded(report) == report


def test_an_old_report_is_shown_as_a_new_one(capsys):
    report = load_report(OLD)
    render(report)
    shown = capsys.readouterr().out
    for scan in report["scans"]:
        (row,) = (line for line in shown.splitlines() if line.startswith(scan["name"]))
        assert f"{scan['assessment']['inlier_ratio']:.2f}" in row.split()


def test_an_old_configuration_runs_under_its_new_names():
    """Every renamed parameter is one of a stage now, and none was before."""
    from mvreg.config.renamed import PARAMETERS
    from mvreg.plugins import manager

    have = {f"{s.kind}.{p}" for s in manager.stages().values() for p in s.parameters}
    assert set(PARAMETERS.values()) <= have
    assert not set(PARAMETERS) & have


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("strategy.patience=5", "strategy.patience has been renamed to strategy.max_failures"),
        ("judge.max_rival=0.2", "judge.max_rival has been renamed to judge.max_alternative"),
        ("+judge.max_rival=0.2", "judge.max_rival has been renamed to judge.max_alternative"),
    ],
)
def test_an_old_parameter_names_its_new_one(override, said):
    from mvreg.config.compose import compose

    with pytest.raises(mvreg.InputError, match=said):
        compose([override])
