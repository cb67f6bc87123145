"""The tests of a new plugin."""

from __future__ import annotations

from mvreg.contracts import KINDS
from mvreg.kit.naming import Naming

STAGE = '''\
"""Does the stage keep its contract, and does it work in a run?"""

from {package} import mvreg_stages
from {package}.stage import {cls}

import mvreg
from mvreg.testing import {contract}


class Test{cls}({contract}):
    stage = {cls}()


def test_it_is_registered_under_its_name():
    assert mvreg_stages() == {{"{kind}/{name}": {cls}}}


'''

PRESET = """\
def test_the_preset_places_small_scans_where_they_belong():
    scans = mvreg.dataset("tiny")
    result = mvreg.register(scans, "{name}")
    assert result.unregistered == ()
    errors = mvreg.pose_errors(result.poses, scans.poses, result.reference)
    assert errors is not None
    assert errors.max.angle < 3  # degrees
    assert errors.max.translation < 3  # mm
"""

DATASET = """\
def test_its_scans_can_be_registered_where_they_belong():
    scans = mvreg.dataset("{name}")
    result = mvreg.register(scans)
    assert result.unregistered == ()
    errors = mvreg.pose_errors(result.poses, scans.poses, result.reference)
    assert errors is not None
    assert errors.max.angle < 0.1  # degrees
    assert errors.max.translation < 0.1  # mm


def test_the_preset_has_more_points():
    few, many = mvreg.dataset("{name}"), mvreg.dataset("{name}_dense")
    assert len(many.scans[0].points) > 1.5 * len(few.scans[0].points)
"""

READER = '''\
"""Does the format keep its contract, is it read, and is a damaged file refused?"""

import numpy as np
import pytest
from {package}.reader import {upper}

import mvreg
from mvreg.testing import ReaderContract


def write(path, points, intensity):
    rows = np.column_stack([points, intensity]).tolist()
    lines = [f"{name} {{len(rows)}}", *(" ".join(map(repr, row)) for row in rows)]
    path.write_text("\\n".join(lines) + "\\n")


class Test{camel}(ReaderContract):
    format = {upper}

    def write(self, path, points):
        write(path, points, np.arange(len(points)))


def test_a_folder_of_such_files_is_read(tmp_path):
    scans = mvreg.dataset("tiny", views=2).scans
    for scan in scans:
        write(tmp_path / f"{{scan.name}}.{name}", scan.points, np.arange(len(scan.points)))
    read = mvreg.dataset("folder", path=str(tmp_path)).scans
    assert [scan.name for scan in read] == [f"{{scan.name}}.{name}" for scan in scans]
    for old, new in zip(scans, read, strict=True):
        np.testing.assert_array_equal(new.points, old.points)
        np.testing.assert_array_equal(new.attributes["intensity"], np.arange(len(old.points)))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected text that begins with '{name} N'"),
        ("points\\n1 2 3 4\\n", "expected '{name}' and a number of points, got 'points'"),
        ("{name} 2\\n1 2 3 4\\n", "expected 2 lines of points, got 1"),
        ("{name} 1\\n1 2 three 4\\n", ":2: expected x, y, z and an intensity, got '1 2 three 4'"),
    ],
)
def test_a_damaged_file_is_refused_in_words(tmp_path, text, said):
    for number in range(2):
        (tmp_path / f"{{number}}.{name}").write_text(text)
    with pytest.raises(mvreg.InputError, match=said):
        mvreg.dataset("folder", path=str(tmp_path))
'''

EXPORTER = '''\
"""Does the format keep its contract, and does a run write it?"""

import subprocess
import sys

from {package}.exporter import {upper}, read_{name}

from mvreg.testing import ExportContract


class Test{camel}(ExportContract):
    format = {upper}


def test_a_run_writes_it(tmp_path):
    words = ["dataset=tiny", "dataset.views=3", "+method=fcpma", "store=false", "rerun=false",
             "report=false", "export=[{name}]", f"hydra.run.dir={{tmp_path / 'run'}}"]  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "mvreg", *words], cwd=tmp_path, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    poses = read_{name}(tmp_path / "run" / "export")
    assert sorted(poses) == ["tiny_00", "tiny_01", "tiny_02"]
'''

OBSERVER = '''\
"""Does a run leave the table, and what is in it?"""

import csv
import subprocess
import sys

from {package}.observer import COLUMNS


def test_a_run_leaves_a_row_per_scan(tmp_path):
    words = ["dataset=tiny", "dataset.views=3", "+method=fcpma", "store=false", "rerun=false",
             "report=false", f"hydra.run.dir={{tmp_path / 'run'}}"]  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "mvreg", *words], cwd=tmp_path, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "warning" not in done.stderr
    with (tmp_path / "run" / "{name}.csv").open(newline="") as table:
        head, *rows = csv.reader(table)
    assert tuple(head) == COLUMNS
    assert [row[0] for row in rows] == ["tiny_00", "tiny_01", "tiny_02"]
    assert all(row[1] == "True" for row in rows)
    for row in rows:
        assert abs(sum(float(number) ** 2 for number in row[5:9]) - 1) < 1e-9
    assert sum(int(row[-1]) for row in rows) >= 2
'''


def tests_of(naming: Naming) -> str:
    """``tests/test_NAME.py``."""
    words = {"name": naming.name, "package": naming.package, "kind": naming.kind}
    names = {"upper": naming.words["NAMELESS"], "camel": naming.words["Nameless"]}
    if naming.kind == "reader":
        return READER.format(**words, **names)
    if naming.kind == "exporter":
        return EXPORTER.format(**words, **names)
    if naming.kind == "observer":
        return OBSERVER.format(**words)
    contract = f"{KINDS[naming.kind].__name__}Contract"
    text = STAGE + (DATASET if naming.kind == "dataset" else PRESET)
    return text.format(**words, cls=naming.cls, contract=contract)
