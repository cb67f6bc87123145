"""The contract of formats that scans are read from: `mvreg.io.Format`."""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

import numpy as np

from mvreg.errors import InputError
from mvreg.io import Format, NotInPiecesError, PointCloud, ReadOptions, read_clouds
from mvreg.plugins.formats import check
from mvreg.testing.compare import case
from mvreg.testing.scans import blob_scan, sensor_pose
from mvreg.testing.silence import captured
from mvreg.testing.words import close, equal, expect, is_a, same_array
from mvreg.types import Array

#: What is in a file that is none of the format's, by what it is.
DAMAGED = {
    "nothing": b"",
    "blanks": b"   \n\n",
    "words": b"Scanned on Monday, twice.\nThe second is better.\n",
    "bytes of something else": bytes(range(256)) * 8,
}


class ReaderContract:
    """What was written is read, whatever the file is called; what is damaged is refused in words.

    class TestMine(ReaderContract):
        format = MINE

        def write(self, path, points):
            ...
    """

    format: Format
    #: How far coordinates may be off that are read back, relative to the largest.
    tolerance: ClassVar[float] = 1e-12
    #: Of a format that cannot tell that its end is missing, as a table of text, set it to False.
    knows_its_end: ClassVar[bool] = True

    def write(self, path: Path, points: Array) -> None:
        """Write a file of the format with one scan of `points` (N, 3); for a suite to define."""
        raise NotImplementedError

    def points(self) -> Array:
        """Points (N, 3) as scanners have them: far from the origin, to a tenth of a millimetre."""
        scan = blob_scan(sensor_pose(20.0), 300)
        found: Array = np.round(scan.points + np.array([4500.0, -1200.0, 30.0]), 4)
        return found

    def test_it_can_be_registered(self) -> None:
        check(self.format, "the suite")

    def test_what_was_written_is_read(self) -> None:
        for name in names(self.format):
            with case(name), self.written(name) as path:
                (cloud,) = self.read(path)
                self.verify(cloud)

    def test_the_file_stays_as_it_is(self) -> None:
        with self.written() as path:
            before = path.read_bytes()
            self.read(path)
            expect(path.read_bytes() == before, "the file left as it is", "another")
            beside = sorted(file.name for file in path.parent.iterdir() if file != path)
            expect(not beside, "no files beside it", beside)

    def test_it_says_nothing(self) -> None:
        output = io.StringIO()
        with (
            self.written() as path,
            captured() as printed,
            contextlib.redirect_stdout(output),
            contextlib.redirect_stderr(output),
        ):
            self.read(path)
        text = "".join(printed) + output.getvalue()
        expect(not text, "remarks with the cloud, and nothing printed", f"{text[:80]!r}")

    def test_it_is_read_twice_alike(self) -> None:
        with self.written() as path:
            (one,), (two,) = self.read(path), self.read(path)
        same_array("the same points a second time", two.points, one.points)
        equal("the same attributes a second time", sorted(two.attributes), sorted(one.attributes))

    def test_what_is_damaged_is_refused_in_words(self) -> None:
        for name, content in DAMAGED.items():
            with case(name), self.written() as path:
                path.write_bytes(content)
                self.refused(path)

    def test_a_file_that_is_cut_off_is_refused(self) -> None:
        with self.written() as path:
            whole = path.read_bytes()
            for share in (0.02, 0.5, 0.9):
                with case(f"{share:.0%} of the file"):
                    path.write_bytes(whole[: int(share * len(whole))])
                    self.cut_off(path)

    def test_pieces_are_what_is_read_whole(self) -> None:
        if self.format.pieces is None:
            return
        with self.written() as path:
            (whole,) = self.read(path)
            try:
                found = [each.whole() for each in self.format.pieces(path, ReadOptions())]
            except NotInPiecesError:
                return
            equal("scans read in pieces", len(found), 1)
            same_array("the same points in pieces", found[0].points, whole.points)

    def verify(self, cloud: PointCloud) -> None:
        """Check what was read of `points`."""
        wanted = self.points()
        limit = self.tolerance * float(np.abs(wanted).max())
        is_a("points", cloud.points, np.ndarray)
        equal("points of dtype", cloud.points.dtype, np.dtype(np.float64))
        close("the points that were written, in their order", cloud.points, wanted, 0.0, limit)
        for name, values in cloud.attributes.items():
            equal(f"the number of values of {name!r}", np.shape(values), (len(wanted),))

    def cut_off(self, path: Path) -> None:
        """Check what comes of a file whose end is missing."""
        if self.knows_its_end:
            self.refused(path)
            return
        with contextlib.suppress(InputError):
            for cloud in self.read(path):
                expect(len(cloud.points) < len(self.points()), "fewer points", len(cloud.points))

    def refused(self, path: Path) -> None:
        """Check that a file is refused, and that the message names it."""
        try:
            found = self.read(path)
        except InputError as error:
            expect(str(path) in str(error), "a message that names the file", str(error))
            return
        raise AssertionError(
            f"expected an InputError that says what is wrong; got {len(found)} scan(s)"
        )

    def read(self, path: Path) -> tuple[PointCloud, ...]:
        """All scans of a file, as a folder is read."""
        return read_clouds(path, formats=dict.fromkeys(self.format.suffixes, self.format))

    @contextlib.contextmanager
    def written(self, name: str = "") -> Iterator[Path]:
        """A file of the format with `points`, alone in a folder."""
        with tempfile.TemporaryDirectory(prefix="mvreg-suite-") as folder:
            path = Path(folder) / (name or f"scan{self.format.suffixes[0]}")
            self.write(path, self.points())
            expect(path.is_file(), f"a file written by the suite's write(): {path.name}", "none")
            yield path


def names(format: Format) -> list[str]:
    """What files of a format can be called."""
    return [
        *(f"scan{suffix}" for suffix in format.suffixes),
        f"a scan, üpper (2){format.suffixes[0]}",
        f"SCAN{format.suffixes[0].upper()}",
    ]
