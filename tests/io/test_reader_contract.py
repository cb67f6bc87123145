"""Some of mvreg's own formats and the contract of readers that plugins bring; and what it finds."""

import re
from dataclasses import replace

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.io import READERS, Format, PointCloud, write_ply
from mvreg.testing import ReaderContract


class TestPly(ReaderContract):
    format = READERS[".ply"]

    def write(self, path, points):
        write_ply(path, points)


class TestNumpy(ReaderContract):
    format = READERS[".npy"]

    def write(self, path, points):
        with path.open("wb") as file:
            np.save(file, points)


class TestText(ReaderContract):
    format = replace(READERS[".xyz"], suffixes=(".xyz",))
    knows_its_end = False

    def write(self, path, points):
        np.savetxt(path, points)


def read(path, options, change=lambda points: points):
    try:
        rows = [line.split() for line in path.read_text().splitlines() if line.strip()]
        points = np.array(rows, dtype=float).reshape(-1, 3)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    return [PointCloud(change(points))]


def single(path, options):
    return read(path, options, lambda points: points.astype(np.float32).astype(float))


def sorted_by_x(path, options):
    return read(path, options, lambda points: points[np.argsort(points[:, 0])])


def lenient(path, options):
    try:
        return read(path, options)
    except InputError:
        return [PointCloud(np.zeros((1, 3)))]


def nameless(path, options):
    try:
        return read(path, options)
    except InputError:
        raise InputError("damaged") from None


def writes(path, options):
    path.with_suffix(".log").write_text("read")
    return read(path, options)


@pytest.mark.parametrize(
    ("reader", "test", "said"),
    [
        (single, "what_was_written_is_read", "expected the points that were written"),
        (sorted_by_x, "what_was_written_is_read", "expected the points that were written"),
        (lenient, "what_is_damaged_is_refused_in_words", "expected an InputError that says what"),
        (nameless, "what_is_damaged_is_refused_in_words", "a message that names the file"),
        (read, "a_file_that_is_cut_off_is_refused", "got 1 scan(s)"),
        (writes, "the_file_stays_as_it_is", "expected no files beside it; got ['scan.log']"),
    ],
)
def test_the_contract_finds_what_is_wrong(reader, test, said):
    suite = TestText()
    suite.format = Format("ours", (".ours",), reader)
    suite.knows_its_end = True
    with pytest.raises(AssertionError, match=re.escape(said)):
        getattr(suite, f"test_{test}")()
