"""``mvreg plugins check`` on formats in and out: their suites, and what is no suite of them."""

import pytest

from mvreg.export import PoseFormat
from mvreg.export.poses.matrices import read_matrices, write_matrices
from mvreg.io import READERS, Format, write_ply
from mvreg.kit.formats import check_export, check_reader
from mvreg.kit.outcomes import Status
from mvreg.testing import ExportContract, ReaderContract

READER = Format("Mine", (".mine",), READERS[".ply"].read)
EXPORT = PoseFormat("mine", "matrices.txt", "as mvreg's", write_matrices, read_matrices)


class Suite(ReaderContract):
    format = READER

    def write(self, path, points):
        write_ply(path, points)


class Loose(ExportContract):
    format = EXPORT
    tolerance = 1e-3


def checked(check, each, **suites):
    return list(check(each, {key.replace("_", "/"): s for key, s in suites.items()}, "p", "dist 1"))


def test_a_reader_is_read_by_the_suite_that_its_plugin_has():
    found = checked(check_reader, READER, reader_Mine=Suite)
    assert {one.status for one in found} == {Status.passed}, [one.text for one in found]
    assert len(found) == len([name for name in dir(Suite) if name.startswith("test_")])
    assert {one.subject.name for one in found} == {"reader Mine"}


def test_of_a_reader_without_a_suite_it_is_said_what_would_check_it():
    first, second = checked(check_reader, READER)
    assert (first.status, second.status) == (Status.passed, Status.skipped)
    assert "return a mvreg.testing.ReaderContract as 'reader/Mine'" in second.text


def test_an_export_format_has_the_suite_of_its_plugin_or_the_plain_one():
    for suites in ({}, {"export_mine": Loose}):
        found = checked(check_export, EXPORT, **suites)
        assert {one.status for one in found} == {Status.passed}, [one.text for one in found]


@pytest.mark.parametrize(
    ("suite", "said"),
    [
        (ExportContract, "expected a subclass of mvreg.testing.ReaderContract for 'Mine'"),
        (7, "of mvreg_suites(); got 7"),
        (ReaderContract, "expected ReaderContract.format to be 'Mine'; got None"),
    ],
)
def test_what_is_no_suite_of_it_is_refused(suite, said):
    (found,) = checked(check_reader, READER, reader_Mine=suite)
    assert found.status is Status.failed and said in found.text
