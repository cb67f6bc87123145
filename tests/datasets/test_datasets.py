"""Data sets: where they are looked for, in which order they come, and what is said if not."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from omegaconf import OmegaConf

import mvreg.datasets.download as downloads
import mvreg.datasets.stanford as stanford_module
from mvreg.datasets.base import Order, ScanSource
from mvreg.datasets.folder import Folder
from mvreg.datasets.stanford import Stanford
from mvreg.errors import InputError, RecordError
from mvreg.geometry import se3
from mvreg.io import write_ply
from mvreg.types import Scan, ScanSet

CONF = Path(__file__).parents[2] / "conf" / "dataset"
PRESETS = {"bunny": 10, "dragon": 15, "buddha": 15, "armadillo": 12, "armadillo_virtual": 12}


def compose(base: type, *overrides: dict[str, Any]) -> Any:
    """What Hydra does with a registered data set and a preset's differences."""
    node = OmegaConf.structured(base)
    OmegaConf.set_readonly(node, None)
    return OmegaConf.to_object(OmegaConf.merge(node, *overrides))


def preset(name: str, **overrides: Any) -> Stanford:
    content = OmegaConf.to_container(OmegaConf.load(CONF / f"{name}.yaml"))
    assert isinstance(content, dict)
    assert content.pop("defaults") == ["stanford", "_self_"]
    made = compose(Stanford, content, overrides)
    assert isinstance(made, Stanford)
    return made


@pytest.fixture(autouse=True)
def nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """No MVREG_DATA, no network, an empty cache."""
    cache = tmp_path / "cache"

    def refuse(url: str, names: list[str], target: Path) -> None:
        raise InputError(f"{url}: no connection to the server")

    monkeypatch.delenv("MVREG_DATA", raising=False)
    monkeypatch.setattr(stanford_module, "cache_folder", lambda: cache)
    monkeypatch.setattr(stanford_module, "download", refuse)
    return cache


def quaternion_line(name: str, rng: np.random.Generator) -> str:
    q = rng.normal(size=4)
    numbers = [*rng.normal(size=3), *(q / np.linalg.norm(q))]
    return f"bmesh {name} " + " ".join(f"{number:.9g}" for number in numbers)


def fake(source: Stanford, folder: Path, order: Callable[[list[str]], list[str]] = list) -> Path:
    """Write a set of three-point scans in a folder, in the layout of the real ones."""
    rng = np.random.default_rng(1)
    for i, name in enumerate(source.files):
        write_ply(folder / name, rng.normal(size=(3, 3)) + i)
    lines = [quaternion_line(name, rng) for name in order(source.files)]
    lines.insert(0, "camera 0 -0.1 -0.7 0 1 0 0\nmesh x_cybcyl 0 0 0 0 0 0 1")
    lines.append(quaternion_line("elsewhere.ply", rng))
    (folder / source.conf).write_text("\n".join(lines) + "\n")
    return folder


@dataclass(frozen=True)
class Toy(ScanSource):
    """Two scans of known points; the second has no truth."""

    name: str = "toy"

    def load(self, rng: np.random.Generator) -> ScanSet:
        points = np.random.default_rng(7).normal(size=(6, 20, 3))
        up = np.array([0.0, 0.0, 1.0])
        scans = tuple(Scan(f"s{i}", p, up, up * 5) for i, p in enumerate(points))
        poses = {f"s{i}": se3.random(np.random.default_rng(i), 3.0) for i in range(6) if i != 1}
        return ScanSet("toy", scans, "mm", poses)


def test_given_order_is_as_loaded(rng: np.random.Generator) -> None:
    loaded = Toy()(rng)
    assert [scan.name for scan in loaded.scans] == [f"s{i}" for i in range(6)]
    np.testing.assert_array_equal(loaded.scans[2].points, Toy().load(rng).scans[2].points)


def test_shuffle_changes_only_the_order() -> None:
    orders = set()
    for seed in range(5):
        loaded = Toy(order=Order.shuffle)(np.random.default_rng(seed))
        again = Toy(order=Order.shuffle)(np.random.default_rng(seed))
        names = tuple(scan.name for scan in loaded.scans)
        assert sorted(names) == [f"s{i}" for i in range(6)]
        assert names == tuple(scan.name for scan in again.scans)
        orders.add(names)
        by_name = {scan.name: scan for scan in Toy()(np.random.default_rng(seed)).scans}
        for scan in loaded.scans:
            np.testing.assert_array_equal(scan.points, by_name[scan.name].points)
    assert len(orders) > 1


def test_scramble_moves_every_scan_and_truth_follows(rng: np.random.Generator) -> None:
    before, after = Toy()(rng), Toy(scramble=True)(rng)
    assert before.poses is not None
    assert after.poses is not None
    assert set(after.poses) == set(before.poses)
    for old, new in zip(before.scans, after.scans, strict=True):
        motion = se3.fit(old.points, new.points)
        np.testing.assert_allclose(se3.apply(motion, old.points), new.points, atol=1e-9)
        assert se3.rotation_angle(motion, np.eye(4)) > 0.05
        extent = np.ptp(old.points, axis=0).max()
        assert 0 < np.abs(motion[:3, 3]).max() <= extent
        np.testing.assert_allclose(new.view_direction, motion[:3, :3] @ old.view_direction)
        np.testing.assert_allclose(
            new.view_point, se3.apply(motion, old.view_point[None])[0], atol=1e-9
        )
        if old.name in before.poses:
            np.testing.assert_allclose(
                se3.apply(after.poses[new.name], new.points),
                se3.apply(before.poses[old.name], old.points),
                atol=1e-9,
            )


def test_scrambled_rotations_are_uniform() -> None:
    """The mean of uniform rotations is zero: none is preferred."""
    found = []
    for seed in range(300):
        after = Toy(scramble=True)(np.random.default_rng(seed))
        assert after.scans[0].view_direction is not None
        found.append(after.scans[0].view_direction)
    assert np.linalg.norm(np.mean(found, axis=0)) < 0.15


def test_hydra_knows_the_orders(tmp_path: Path) -> None:
    assert compose(Folder, {"order": "shuffle"}).order is Order.shuffle
    assert Folder(order="shuffle").order is Order.shuffle  # type: ignore[arg-type]
    with pytest.raises(InputError, match="given, shuffle"):
        Folder(order="sideways")  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "count"), PRESETS.items())
@pytest.mark.parametrize("where", [0, -1, None])
def test_presets_load_in_every_layout(
    tmp_path: Path, name: str, count: int, where: int | None, rng: np.random.Generator
) -> None:
    source = preset(name, root=str(tmp_path / "root"))
    inside = "" if where is None else source.folders[where]
    fake(source, tmp_path / "root" / inside, order=lambda files: files[::-1])
    loaded = source(rng)
    assert (loaded.name, loaded.unit, len(loaded.scans)) == (name, "mm", count)
    assert [scan.name for scan in loaded.scans] == source.files[::-1], "in the order of the .conf"
    assert loaded.poses is not None
    assert set(loaded.poses) == set(source.files)
    for scan in loaded.scans:
        np.testing.assert_array_equal(scan.view_direction, [0, 0, 1])
    metres = preset(name, root=str(tmp_path / "root"), unit_per_metre=1.0)(rng)
    assert metres.unit == "m"
    assert metres.poses is not None
    first = loaded.scans[0].name
    np.testing.assert_allclose(loaded.scans[0].points, 1000 * metres.scans[0].points)
    np.testing.assert_allclose(loaded.poses[first][:3, 3], 1000 * metres.poses[first][:3, 3])
    np.testing.assert_allclose(loaded.poses[first][:3, :3], metres.poses[first][:3, :3])


@pytest.mark.parametrize("name", ["bunny", "dragon", "buddha", "armadillo_virtual"])
def test_real_scans_load(data_root: Path, name: str, rng: np.random.Generator) -> None:
    loaded = preset(name, root=str(data_root))(rng)
    assert len(loaded.scans) == PRESETS[name]
    assert loaded.scans[0].name in {
        "bun000.ply", "dragonStandRight_0.ply", "happyStandRight_0.ply", "ArmadilloVirtual_0.ply",
    }  # fmt: skip
    assert loaded.poses is not None
    assert len(loaded.poses) == PRESETS[name]
    for scan in loaded.scans:
        assert 50 < np.ptp(scan.points, axis=0).max() < 300, "millimetres"


def test_real_scans_are_found_through_the_environment(
    data_root: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    monkeypatch.setenv("MVREG_DATA", str(data_root))
    assert len(preset("bunny")(rng).scans) == 10


def test_root_comes_before_environment_before_cache(
    tmp_path: Path, nowhere: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    source = preset("bunny", root=str(tmp_path / "root"))
    monkeypatch.setenv("MVREG_DATA", str(tmp_path / "env"))
    places = [nowhere / "bunny", tmp_path / "env/bunny/data", tmp_path / "root/bunny/data"]
    for i, place in enumerate(places, 1):
        fake(source, place)
        write_ply(place / source.files[0], np.full((1, 3), float(i)))
        assert source(rng).scans[0].points[0, 0] == 1000 * i


def test_scans_without_truth_come_last(tmp_path: Path, rng: np.random.Generator) -> None:
    source = preset("armadillo", root=str(tmp_path))
    fake(source, tmp_path, order=lambda files: files[:0:-1])
    loaded = source(rng)
    assert loaded.scans[-1].name == source.files[0]
    assert loaded.poses is not None
    assert source.files[0] not in loaded.poses


def test_missing_files_are_listed(tmp_path: Path, rng: np.random.Generator) -> None:
    source = preset("armadillo", root=str(tmp_path))
    folder = fake(source, tmp_path / "Armadillo_scans")
    (folder / "ArmadilloStand_90.ply").unlink()
    (folder / "ArmadilloStand_330.ply").unlink()
    with pytest.raises(InputError) as caught:
        source(rng)
    message = str(caught.value)
    assert f"{folder} lacks ArmadilloStand_90.ply, ArmadilloStand_330.ply\n" in message
    assert "ArmadilloStand_60" not in message
    assert source.url in message


def test_without_network_the_error_shows_the_ways_on(
    tmp_path: Path, nowhere: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    monkeypatch.setenv("MVREG_DATA", str(tmp_path / "env"))
    source = preset("dragon", root=str(tmp_path / "root"))
    with pytest.raises(InputError) as caught:
        source(rng)
    message = str(caught.value)
    for expected in (
        tmp_path / "root", tmp_path / "env", nowhere, "dragon_stand", source.url,
        "dragonStandRight.conf", *source.files, "dataset=figurine", "MVREG_DATA", "no connection",
    ):  # fmt: skip
        assert str(expected) in message


def test_what_cannot_be_downloaded_says_where_it_may_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    def unexpected(url: str, names: list[str], target: Path) -> None:
        raise AssertionError(f"asked for {url!r}")

    monkeypatch.setattr(stanford_module, "download", unexpected)
    monkeypatch.setenv("MVREG_DATA", str(tmp_path / "env"))
    source = preset("armadillo_virtual", root=str(tmp_path / "root"))
    with pytest.raises(InputError, match="there is no address to download it from") as caught:
        source(rng)
    for expected in (tmp_path / "root", tmp_path / "env", "ArmadilloVirtual.conf", "MVREG_DATA"):
        assert str(expected) in str(caught.value)
    folder = fake(source, tmp_path / "env/armadillo_virtual")
    (folder / "ArmadilloVirtual_30.ply").unlink()
    with pytest.raises(InputError, match=r"lacks ArmadilloVirtual_30\.ply\nComplete it, or point"):
        source(rng)


def test_the_bare_class_is_no_data_set(rng: np.random.Generator) -> None:
    with pytest.raises(InputError, match="dataset=bunny"):
        Stanford()(rng)
    with pytest.raises(InputError, match="unit_per_metre"):
        Stanford(unit_per_metre=0)


def folder_of(path: Path, *names: str) -> Path:
    for i, name in enumerate(names):
        write_ply(path / name, np.full((4, 3), 1.0 + i))
    return path


def test_a_folder_is_read_as_people_count(tmp_path: Path, rng: np.random.Generator) -> None:
    path = folder_of(tmp_path / "mine", "scan10.ply", "scan2.PLY", "Scan1.ply", ".hidden.ply")
    (path / "b.xyz").write_text("1 2 3\n")
    np.save(path / "a.npy", np.ones((4, 3)))
    for ignored in ("truth.conf", "result.json", "README.md", "Makefile"):
        (path / ignored).write_text("no scan")
    (path / "folder.ply").mkdir()
    loaded = Folder(path=str(path))(rng)
    assert [s.name for s in loaded.scans] == [
        "a.npy", "b.xyz", "Scan1.ply", "scan2.PLY", "scan10.ply",
    ]  # fmt: skip
    assert (loaded.name, loaded.unit, loaded.poses) == ("mine", "file", None)
    assert all(s.view_direction is None and s.view_point is None for s in loaded.scans)
    only = Folder(path=str(path), pattern="scan*", unit="m")(rng)
    assert [s.name for s in only.scans] == ["scan2.PLY", "scan10.ply"]
    assert only.unit == "m"


@pytest.mark.parametrize("path", [".", "~", "mine", "mine/"])
def test_a_folder_has_a_name(
    tmp_path: Path, path: str, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    folder_of(tmp_path / "mine", "a.ply", "b.ply")
    monkeypatch.chdir(tmp_path if "mine" in path else tmp_path / "mine")
    monkeypatch.setenv("HOME", str(tmp_path / "mine"))
    source = Folder(path=path)
    assert source.name == source(rng).name == "mine"


def test_ground_truth_of_a_subset_is_fine(tmp_path: Path, rng: np.random.Generator) -> None:
    path = folder_of(tmp_path / "mine", "a.ply", "b.ply", "c.ply")
    pose = se3.random(rng, 4.0)
    for file in (tmp_path / "truth.json", path / "inside.json"):
        file.write_text(json.dumps({"b.ply": pose.tolist(), "other.ply": np.eye(4).tolist()}))
        given = str(file) if file.parent == tmp_path else file.name
        loaded = Folder(path=str(path), ground_truth=given)(rng)
        assert loaded.poses is not None
        assert list(loaded.poses) == ["b.ply"]
        np.testing.assert_allclose(loaded.poses["b.ply"], pose, atol=1e-12)


def test_ground_truth_of_other_scans_is_an_error(tmp_path: Path, rng: np.random.Generator) -> None:
    path = folder_of(tmp_path / "mine", "a.ply", "b.ply")
    (path / "t.json").write_text(json.dumps({"other.ply": np.eye(4).tolist()}))
    with pytest.raises(InputError, match=r"a\.ply, b\.ply; got poses of other\.ply"):
        Folder(path=str(path), ground_truth="t.json")(rng)
    with pytest.raises(InputError, match=r"missing\.json: cannot be read"):
        Folder(path=str(path), ground_truth="missing.json")(rng)


def test_all_unreadable_files_are_reported_at_once(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    path = folder_of(tmp_path / "mine", "a.ply", "b.ply")
    (path / "bad.ply").write_text("solid")
    (path / "worse.xyz").write_text("1 2 3\n4 five 6\n")
    with pytest.raises(InputError) as caught:
        Folder(path=str(path))(rng)
    message = str(caught.value)
    assert message.startswith("2 of 4 files cannot be read")
    assert f"{path / 'bad.ply'}, line 1" in message
    assert f"{path / 'worse.xyz'}, line 2: expected" in message
    assert "dataset.pattern" in message


@pytest.mark.parametrize(
    ("names", "options", "message"),
    [
        ((), {"path": ""}, "dataset.path=DIR"),
        ((), {}, "found nothing among nothing"),
        (("a.ply",), {}, "at least 2 scans .* found a.ply among a.ply"),
        (("a.ply", "b.ply"), {"pattern": "c*"}, "found nothing among a.ply, b.ply"),
        (tuple(f"{i}.ply" for i in range(12)), {"pattern": "c*"}, "and 2 more"),
        ((), {"path": "/no/such/folder"}, "/no/such/folder: expected a folder: No such file"),
    ],
)
def test_what_is_no_folder_of_scans_says_so(
    tmp_path: Path, names: tuple[str, ...], options: dict[str, str], message: str
) -> None:
    (tmp_path / "mine").mkdir()
    source = Folder(**{"path": str(folder_of(tmp_path / "mine", *names)), **options})
    with pytest.raises(InputError, match=message):
        source(np.random.default_rng(0))


@pytest.mark.parametrize("options", [{"pattern": ""}, {"pattern": "a/*"}, {"unit": ""}])
def test_wrong_options_are_refused_at_once(options: dict[str, str]) -> None:
    with pytest.raises(InputError, match="expected"):
        Folder(path="x", **options)


def test_a_file_is_no_folder(tmp_path: Path, rng: np.random.Generator) -> None:
    (tmp_path / "a.ply").write_text("x")
    with pytest.raises(InputError, match="Not a directory"):
        Folder(path=str(tmp_path / "a.ply"))(rng)


def test_the_cache_is_the_platform_s(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert downloads.cache_folder().name == "datasets"
    assert "mvreg" in downloads.cache_folder().parts


@pytest.mark.parametrize("field", ["poses", "motions"])
@pytest.mark.parametrize("wrong", [np.full((4, 4), np.nan), np.diag([1.0, 1.0, 2.0, 1.0]), None])
def test_a_truth_that_is_no_pose_is_refused(field, wrong):
    with pytest.raises(RecordError, match=rf"ScanSet\.{field}\['a'\]: expected"):
        ScanSet("toy", (Scan("a", np.eye(3)),), **{field: {"a": wrong}})
    with pytest.raises(RecordError, match=rf"ScanSet\.{field}: expected a mapping"):
        ScanSet("toy", (), **{field: [np.eye(4)]})
