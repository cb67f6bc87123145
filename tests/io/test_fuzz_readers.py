"""Damaged files of every format: points or an `InputError`, soon, without a warning."""

from __future__ import annotations

import time
import warnings
from pathlib import Path

import numpy as np
import pytest

from experiments.fuzz.files import damaged, good_files
from mvreg.errors import InputError
from mvreg.io import READERS, read_clouds

#: Together with the number of formats, 20,000 files.
FILES = 640
#: libe57 opens no file in less than a millisecond or two, and archives are unpacked to disk.
SLOW = {".e57": 300, ".glb": 300, ".gltf": 300, ".zip": 300, ".gz": 300}


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return good_files(tmp_path_factory.mktemp("good"))


def names() -> list[str]:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        return sorted(good_files(Path(folder)))


def test_every_format_is_there(good: dict[str, bytes], tmp_path: Path) -> None:
    missing = set(READERS) - {f".{name.rsplit('.', 1)[1]}" for name in good}
    assert missing <= {".e57", ".glb", ".gltf"}
    if missing:
        pytest.skip(f"NOT FUZZED, since an extra is not installed: {', '.join(sorted(missing))}")
    for name, content in good.items():
        (tmp_path / name).write_bytes(content)
        clouds = read_clouds(tmp_path / name)
        assert all(len(cloud.points) for cloud in clouds)


@pytest.mark.parametrize("name", names())
def test_damage_is_an_error_or_points(good: dict[str, bytes], tmp_path: Path, name: str) -> None:
    rng = np.random.default_rng(sum(name.encode()))
    path = tmp_path / name
    for _ in range(SLOW.get(path.suffix, FILES)):
        path.write_bytes(damaged(good[name], rng))
        began = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                clouds = read_clouds(path)
            except InputError as error:
                assert str(path) in str(error)
            else:
                assert clouds
                for cloud in clouds:
                    assert len(cloud.points) > 0
                    assert np.isfinite(cloud.points).all()
                    assert all(len(v) == len(cloud.points) for v in cloud.attributes.values())
        assert time.perf_counter() - began < 10
