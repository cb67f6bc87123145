"""Runs brought into the frame of a map by targets."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.cli.main import main
from mvreg.errors import InputError
from mvreg.export.placements import Component, Placements
from mvreg.export.run import export
from mvreg.export.table import BY_NAME
from mvreg.export.targets import Targets, fitted
from mvreg.geometry import se3
from mvreg.io import read_cloud
from mvreg.io.targets import Target

RNG = np.random.default_rng(7)
WORLD = RNG.uniform(-50, 50, (6, 3))
NAMES = [f"T{k}" for k in range(6)]
MAP = se3.from_parts(se3.random(RNG)[:3, :3], np.array([450_000.0, 5_400_000.0, 300.0]))
#: Turned about the vertical alone, as levelled scanners have it.
LEVEL = se3.from_parts(se3.exp(np.array([0, 0, 1.0, 0, 0, 0]))[:3, :3], MAP[:3, 3])


def write(path, rows):
    path.write_text("".join(";".join(map(str, row)) + "\n" for row in rows))
    return path


def test_that_exact_targets_give_the_exact_frame():
    pose, said = fitted(NAMES, WORLD, se3.apply(LEVEL, WORLD), "files")
    np.testing.assert_allclose(pose[:3, :3], LEVEL[:3, :3], atol=1e-10)
    np.testing.assert_allclose(se3.apply(pose, WORLD), se3.apply(LEVEL, WORLD), atol=1e-7)
    assert len(said) == 7 and said[-1].startswith("in the frame of the map by 6 targets, RMS ")
    three, _ = fitted(NAMES[:3], WORLD[:3], se3.apply(LEVEL, WORLD[:3]), "files")
    np.testing.assert_allclose(se3.apply(three, WORLD), se3.apply(LEVEL, WORLD), atol=1e-6)


def test_that_residuals_are_told_per_target():
    known = se3.apply(LEVEL, WORLD)
    known[2] += [0.0, 0.02, 0.0]
    _, said = fitted(NAMES, WORLD, known, "files")
    dx, dy, dz, length, _ = said[2].removeprefix("target T2: ").replace(",", "").split()
    assert 0.01 < float(dy) < 0.02 and abs(float(dx)) < 0.01 and abs(float(dz)) < 0.01
    assert float(length) == pytest.approx(np.hypot(np.hypot(float(dx), float(dy)), float(dz)), 1e-2)


SWAPPED = se3.apply(LEVEL, WORLD)[:, [1, 0, 2]]
OUT = se3.apply(LEVEL, WORLD) + np.eye(6)[:, [3]] * [0.0, 7.0, 0.0]
NOISE = se3.apply(LEVEL, WORLD) + RNG.normal(0, 5, (6, 3))
LINE = np.outer(np.arange(6.0), [1, 2, 3])


@pytest.mark.parametrize(
    ("model", "known", "said"),
    [
        (WORLD[:2], se3.apply(LEVEL, WORLD[:2]), "three targets or more in both, got T0, T1$"),
        (LINE, se3.apply(LEVEL, LINE), "T0, .* are on one line, about which"),
        (WORLD, SWAPPED, "but mirrored they do: are easting and northing in their columns"),
        (WORLD, se3.apply(LEVEL, 1000 * WORLD), "but 1000 times as large they do: .* no scale"),
        (WORLD, OUT, r"target T3 is 7 from where the others say, which fit to .*: is it another"),
        (WORLD, NOISE, r"do not fit, RMS [\d.]+: T\d and T\d are [\d.]+ apart in the model and"),
    ],
)
def test_that_targets_that_do_not_do_are_refused_in_words(model, known, said):
    with pytest.raises(InputError, match=said):
        fitted(NAMES[: len(model)], model, known, "measured.csv and map.csv")


def test_that_a_model_upside_down_is_told():
    flat = WORLD * [1, 1, 0]
    swapped = se3.apply(LEVEL, flat)[:, [1, 0, 2]]
    _, said = fitted(NAMES, flat, swapped, "files")
    assert "upside down: are easting and northing" in said[-1]


def test_that_components_come_by_their_own_targets(tmp_path):
    poses = {name: se3.random(RNG, 5) for name in ("a.ply", "b.ply", "c.ply", "d.ply")}
    components = (
        Component(1, "a.ply", {name: poses[name] for name in ("a.ply", "b.ply")}),
        Component(2, "c.ply", {"c.ply": poses["c.ply"]}),
        Component(3, "d.ply", {"d.ply": poses["d.ply"]}),
    )
    found = Placements(tuple(poses), components, ())

    def seen(scan, which):
        local = se3.apply(se3.invert(poses[scan]), WORLD[which])
        stem = scan.removesuffix(".ply")  # as tables often have it
        return [Target(NAMES[k], stem, p, 1) for k, p in zip(which, local, strict=True)]

    measured = (
        *seen("a.ply", [0, 1, 2]), *seen("b.ply", [2, 3]), *seen("c.ply", [1, 3, 5]),
        *seen("d.ply", [0, 1]),
    )  # fmt: skip
    known = tuple(Target(n, "", p, 1)
                  for n, p in zip(NAMES, se3.apply(LEVEL, WORLD), strict=True))  # fmt: skip
    moved, said = Targets(measured, known, ("m", "k")).in_map(found)
    for k, names in ((0, ("a.ply", "b.ply")), (1, ("c.ply",))):
        for name in names:
            np.testing.assert_allclose(moved.components[k].poses[name], LEVEL @ poses[name],
                                       atol=1e-6)  # fmt: skip
    assert moved.components[2] is components[2]
    assert "component_3 has no three targets: not in the map" in said
    report = {
        "reference": "a.ply",
        "poses": components[0].poses,
        "components": [{"number": c.number, "reference": c.reference, "poses": c.poses}
                       for c in components[1:]],
    }  # fmt: skip
    told = export(report, [], tmp_path, list, list, Targets(measured, known, ("m", "k")))
    assert "component_2 is in the frame of the map: c.ply" in told
    assert any(each.startswith("component_2: target T1: ") for each in told)
    assert "component_3 is in a frame of its own, that of d.ply: d.ply" in told
    odd = Targets((*measured, Target("T0", "x.ply", np.zeros(3), 9)), known, ("m", "k"))
    with pytest.raises(InputError, match=r"m: expected targets measured in .* a.ply, .*x.ply"):
        odd.in_map(found)
    twins = replace(found, names=(*found.names, "a.pts"))  # of which one is "a"?
    with pytest.raises(InputError, match=r"m: a may be any of the scans a.ply, a.pts; write"):
        Targets(measured, known, ("m", "k")).in_map(twins)


def test_that_a_run_is_exported_in_the_frame_of_the_map(tmp_path, capsys):
    run = tmp_path / "run"
    words = ["dataset=tiny", "rerun=false", "report=false", f"hydra.run.dir={run}"]
    assert main(words) == 0
    truth = mvreg.dataset("tiny").poses
    targets = RNG.uniform(-80, 80, (4, 3))
    rows = [
        (f"T{k}", name, *se3.apply(se3.invert(truth[name]), target))
        for k, target in enumerate(targets) for name in list(truth)[k : k + 2]
    ]  # fmt: skip
    measured = write(tmp_path / "measured.csv", rows)
    known = write(tmp_path / "map.csv", [
        (f"T{k}", *target) for k, target in enumerate(se3.apply(LEVEL, targets))
    ])  # fmt: skip
    capsys.readouterr()
    assert main(["export", str(run), "4x4", "las", "--targets", str(measured), str(known)]) == 0
    said = capsys.readouterr().err
    assert "target T3: " in said and "in the frame of the map by 4 targets, RMS 0.0" in said
    found = BY_NAME["matrices"].read(run / "export")
    for name, pose in found.items():
        np.testing.assert_allclose(pose[:3, :3], (LEVEL @ truth[name])[:3, :3], atol=2e-3)
        np.testing.assert_allclose(pose[:3, 3], (LEVEL @ truth[name])[:3, 3], atol=0.1)
    points = read_cloud(run / "export" / "model.las").points
    middle = se3.apply(found["tiny_00"], mvreg.dataset("tiny").scans[0].points).mean(axis=0)
    assert np.linalg.norm(points.mean(axis=0) - middle) < 100
    report = json.loads((run / "result.json").read_text())
    assert np.abs(np.array(report["poses"]["tiny_00"])[:3, 3]).max() < 1000, "it stays as it was"


def test_that_the_map_has_a_target_once(tmp_path):
    world = se3.apply(LEVEL, WORLD)
    rows = [(name, *xyz) for name, xyz in zip(NAMES, world, strict=True)]
    measured = write(tmp_path / "measured.csv",
                     [(name, *xyz) for name, xyz in zip(NAMES, WORLD, strict=True)])  # fmt: skip
    heading = ("name", "scan", "x", "y", "z")
    twice = [(name, scan, *xyz) for name, *xyz in rows for scan in ("a", "b")]
    found = Targets.read(measured, write(tmp_path / "map.csv", [heading, *twice]))
    assert [target.name for target in found.known] == NAMES
    twice[1] = ("T0", "b", 0.0, 0.0, 0.0)
    with pytest.raises(InputError, match=r"map.csv, line 3: target 'T0' is elsewhere in line 2"):
        Targets.read(measured, write(tmp_path / "map.csv", [heading, *twice]))
