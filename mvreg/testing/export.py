"""The contract of export formats: ``mvreg export RUN NAME``."""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, ClassVar
from unittest import SkipTest

import numpy as np

from mvreg.export.brought import check
from mvreg.export.formats import Format, PointFormat, PoseFormat
from mvreg.export.placements import Component, Placements
from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree, nearest
from mvreg.io import READERS, read_clouds
from mvreg.testing.compare import case, digest
from mvreg.testing.placed import model_of, placed_scanset, placements_of_a_run, points_of
from mvreg.testing.silence import captured
from mvreg.testing.words import close, equal, expect
from mvreg.types import Array


class ExportContract:
    """What is said to be written is written, by name, for every component, and can be read back.

        class TestMine(ExportContract):
            format = MINE

    The run has four placed scans in two components, one without a pose, names as files have them,
    and poses far from the origin.
    """

    format: Format
    #: Of a format whose files have a time or a random identifier in them, set it to False.
    repeatable: ClassVar[bool] = True
    #: How far poses may be off that ``read`` gives back, relative to their translations.
    tolerance: ClassVar[float] = 1e-12
    #: How far points may be off that are read back (the scans' spacings).
    points_tolerance: ClassVar[float] = 0.01

    def points_back(self, folder: Path) -> Array | None:
        """The points (N, 3) in the model's frame, as whoever reads the files gets them.

        None: they are not looked at. If not defined, by mvreg's own readers, where they know the
        endings of the files.
        """
        files = [file for file in sorted(folder.rglob("*")) if file.is_file()]
        if not files or any(file.suffix.lower() not in READERS for file in files):
            return None
        clouds = [cloud for file in files for cloud in read_clouds(file)]
        poses = [np.eye(4) if c.T_world_scan is None else c.T_world_scan for c in clouds]
        return np.concatenate([se3.apply(T, c.points) for T, c in zip(poses, clouds, strict=True)])

    def test_it_can_be_registered(self) -> None:
        check(self.format, "the suite")

    def test_it_writes_what_it_says_and_nothing_elsewhere(self) -> None:
        patterns = self.format.files.replace("NAME", "*")
        for name, component in self.components():
            with case(name), written(self.format, component) as (folder, _):
                outside = sorted(p.name for p in folder.parent.iterdir() if p != folder)
                expect(not outside, "files in the folder that is given, and no other", outside)
                files = listed(folder)
                fits = [file for file in files if fnmatchcase(file, patterns)]
                expect(fits, f"a file as `files` has it, {self.format.files}", files)
                empty = [f for f in fits if not (folder / f).stat().st_size]
                expect(not empty, "something in the files", f"nothing in {empty}")

    def test_remarks_are_a_list_of_texts(self) -> None:
        for name, component in self.components():
            with case(name), written(self.format, component) as (_, said):
                fine = isinstance(said, list) and all(isinstance(each, str) for each in said)
                expect(fine, "a list of remarks, [] where there is nothing to say", said)

    def test_it_leaves_what_it_is_given_as_it_is(self) -> None:
        for name, component in self.components():
            before = digest((component, placements_of_a_run(), placed_scanset()))
            with case(name), written(self.format, component):
                after = digest((component, placements_of_a_run(), placed_scanset()))
                expect(after == before, "poses and scans left as they are", "changed ones")

    def test_it_says_nothing(self) -> None:
        (_, component), *_ = self.components()
        output = io.StringIO()
        with (
            captured() as printed,
            contextlib.redirect_stdout(output),
            contextlib.redirect_stderr(output),
            written(self.format, component),
        ):
            pass
        text = "".join(printed) + output.getvalue()
        expect(not text, "remarks returned, and nothing printed", f"{text[:80]!r}")

    def test_what_was_there_is_replaced(self) -> None:
        """A second export into the same folder is as the first."""
        (_, component), *_ = self.components()
        with written(self.format, component) as (folder, _):
            first = contents(folder)
            write(self.format, folder, component)
            again = contents(folder)
        equal("the same files a second time", sorted(again), sorted(first))
        if self.repeatable:
            changed = [name for name in first if again[name] != first[name]]
            expect(not changed, "the same contents a second time", f"others in {changed}")

    def test_other_poses_make_other_files(self) -> None:
        (_, component), *_ = self.components()
        turn = se3.random(np.random.default_rng(3), 20.0)
        other = replace(component, poses={n: turn @ T for n, T in component.poses.items()})
        with written(self.format, component) as (folder, _):
            one = contents(folder)
        with written(self.format, other) as (folder, _):
            two = contents(folder)
        expect(one != two, "what is written to follow from the poses", "the same for other poses")

    def test_poses_come_back_as_they_were(self) -> None:
        read = getattr(self.format, "read", None)
        if not (isinstance(self.format, PoseFormat) and read is not None):
            return
        for name, component in self.components():
            with case(name), written(self.format, component) as (folder, _):
                found: dict[str, Array] = read(folder)
            equal("poses by the names of the scans", sorted(found), sorted(component.poses))
            for scan, pose in component.poses.items():
                size = max(1.0, float(np.abs(pose).max()))
                close(f"T_model_scan of {scan!r}", found[scan], pose, 0.0, self.tolerance * size)

    def test_points_come_back_where_they_were(self) -> None:
        if not isinstance(self.format, PointFormat):
            return
        for name, component in self.components():
            with case(name), written(self.format, component) as (folder, _):
                found = self.points_back(folder)
            if found is None:
                raise SkipTest("the format is not read: define points_back()")
            there = points_of(component)
            equal("the number of points", len(found), len(there))
            spacing = placed_scanset().scans[0].spacing
            apart = max(float(nearest(build_tree(a), b)[0].max())
                        for a, b in ((found, there), (there, found)))  # fmt: skip
            limit = self.points_tolerance * spacing
            expect(apart <= limit, f"points within {limit:.2g} of where they belong",
                   f"one off by {apart:.3g}")  # fmt: skip

    def components(self) -> list[tuple[str, Component]]:
        """What is written, by what it is."""
        first, second = placements_of_a_run().components
        return [("three scans", first), ("the second component, one scan", second)]


def write(format: Format, folder: Path, component: Component) -> Any:
    """Write a component of the run, as an export does."""
    found: Placements = placements_of_a_run()
    if isinstance(format, PointFormat):
        return format.write(folder, model_of(component, found))
    return format.write(folder, component, found)


@contextlib.contextmanager
def written(format: Format, component: Component) -> Iterator[tuple[Path, Any]]:
    """An empty folder into which it is written, alone in its own, and what is returned."""
    with tempfile.TemporaryDirectory(prefix="mvreg-suite-") as holder:
        folder = Path(holder) / "export"
        folder.mkdir()
        yield folder, write(format, folder, component)


def listed(folder: Path) -> list[str]:
    """The files below a folder, from there."""
    return sorted(f.relative_to(folder).as_posix() for f in folder.rglob("*") if f.is_file())


def contents(folder: Path) -> dict[str, bytes]:
    """The files below a folder and their bytes."""
    return {name: (folder / name).read_bytes() for name in listed(folder)}
