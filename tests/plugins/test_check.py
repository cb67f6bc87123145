"""``mvreg plugins check``: what is wrong with a plugin, in words, before a run meets it."""

import re

import pytest
from fake_plugins import install, mvreg, write_metadata

from mvreg.cli.checking import findings, table
from mvreg.kit.check import check_plugins
from mvreg.kit.outcomes import Outcome, Status, Subject
from mvreg.plugins import manager
from mvreg.testing import SUITES

HEAD = """
import numpy as np
from dataclasses import dataclass, replace
from mvreg.errors import InputError
from mvreg.stages import NearestSeed, TrimmedICP, PointToPlaneJudge
from mvreg.types import Matches
"""

GOOD = (
    HEAD
    + """
@dataclass(frozen=True)
class Fine(NearestSeed):
    '''Fewer of the nearest.'''
    top_fraction: float = 0.2

@dataclass(frozen=True)
class Needs:
    '''Needs to know how many.'''
    most: int
    def __call__(self, source, target):
        return NearestSeed()(source, target)

def mvreg_stages():
    return {"seed/fine": Fine, "seed/needs": Needs}

def mvreg_event(event):
    pass
"""
)

BAD = (
    HEAD
    + """
@dataclass(frozen=True)
class AList(NearestSeed):
    '''Answers a list.'''
    def __call__(self, source, target):
        return list(super().__call__(source, target).indices)

@dataclass(frozen=True)
class Broken(TrimmedICP):
    '''Answers NaN.'''
    def __call__(self, source, target, T_init):
        found = super().__call__(source, target, T_init)
        return replace(found, T_target_source=np.full((4, 4), np.nan))

@dataclass(frozen=True)
class Divides(PointToPlaneJudge):
    '''Fails.'''
    def __call__(self, registration, source, target, graph):
        return 1 / 0

@dataclass(frozen=True)
class Ready(NearestSeed):
    '''Cannot be made of its defaults.'''
    top_fraction: float = 3.0

def mvreg_stages():
    return {
        "seed/alist": AList, "refine/broken": Broken, "judge/divides": Divides, "seed/ready": Ready
    }

def mvreg_event(event):
    raise OSError("the disk is full")

def mvreg_suites():
    return {"seed/other": AList}
"""
)


@pytest.fixture
def packages(tmp_path):
    install(tmp_path, "good", GOOD)
    install(tmp_path, "bad", BAD)
    return tmp_path


def test_a_plugin_that_keeps_its_contracts_passes(packages):
    done = mvreg("plugins", "check", "good", packages=packages, cwd=packages)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"seed=fine +good +dist-good 0\.3 +\d\d +0 +0 +ok", done.stdout)
    assert re.search(r"observer +good +dist-good 0\.3 +1 +0 +0 +ok", done.stdout)
    assert (
        "skipped: seed=needs (plugin 'good', dist-good 0.3): has a suite\n    needs most"
        in done.stdout
    )
    assert re.search(r"\d+ checks passed, 0 failed\n\Z", done.stdout)
    assert "checking seed=fine, dist-good 0.3" in done.stderr


@pytest.mark.parametrize("name", ["bad", "dist-bad"])
def test_what_is_wrong_is_said_of_every_stage(packages, name):
    done = mvreg("plugins", "check", name, packages=packages, cwd=packages)
    assert done.returncode == 1, done.stderr
    said = done.stdout
    for wanted in (
        r"seed=alist .*: it answers in the right form.*\n    expected the answer: Matches; got a",
        r"seed=alist .*: a run takes its answers\n    seed=alist \(AList, plugin 'bad', dist-bad 0"
        r"\.3\): expected __call__\(source, target\) -> Matches.*; got a list.*; in the case: t",
        r"refine=broken .*\n    expected an answer; got RecordError: .*T_target_source: expected",
        r"judge=divides .*, and 9 other checks\n    expected an answer; got ZeroDivisionError: .*"
        r" at .*bad\.py:\d+",
        r"seed=ready .*: has a suite\n    seed\.top_fraction: expected a share",
        r"observer .*: it takes the events of a run\n    expected an answer; got OSError: the disk",
        r"the plugin .*: its suites are of its stages\n    expected keys .*; got seed/other",
    ):
        assert re.search(rf"failed: {wanted}", said), f"{wanted}\n{said}"
    assert re.search(
        r"skipped: seed=alist .*\n    cannot be asked of answers that are not in t", said
    )
    assert not re.search(r"seed=alist .*\n.* at \S+testing", said)  # later looks into the list
    assert "Traceback" not in said + done.stderr
    assert "good" not in said


def test_one_stage_is_checked_by_its_name(packages):
    done = mvreg("plugins", "check", "seed=fine", packages=packages, cwd=packages)
    assert done.returncode == 0
    assert "seed=needs" not in done.stdout and "seed=fine" in done.stdout


def test_a_plugin_that_cannot_be_loaded_hides_no_other(packages):
    install(packages, "gone", "import nowhere_to_be_found")
    assert mvreg("plugins", "check", "seed=fine", packages=packages, cwd=packages).returncode == 0
    done = mvreg("plugins", "check", "gone", packages=packages, cwd=packages)
    assert done.returncode == 1
    assert re.search(
        r"failed: the plugin \(plugin 'gone', dist-gone 0\.3\): it can be used\n"
        r"    plugin 'gone' .* cannot be imported .*nowhere_to_be_found",
        done.stdout,
    )
    done = mvreg("plugins", "check", "nobody", packages=packages, cwd=packages)
    assert done.returncode == 2
    assert "expected a plugin, a distribution or a stage as kind=name, got 'nobody'" in done.stderr
    assert "good (dist-good)" in done.stderr and "gone (dist-gone)" in done.stderr


CLASH = (
    HEAD
    + """
@dataclass(frozen=True)
class Again(NearestSeed):
    '''A key that mvreg has.'''

def mvreg_stages():
    return {"seed/nearest": Again}
"""
)


def test_a_clash_with_another_plugin_is_found_by_the_check_of_one(packages):
    install(packages, "clash", CLASH)
    done = mvreg("plugins", "check", "clash", packages=packages, cwd=packages)
    assert done.returncode == 1
    assert "failed: all plugins (plugin 'all', together): they go with each other" in done.stdout
    assert "'seed/nearest' is registered twice: by plugin" in done.stdout
    assert mvreg("plugins", "check", "seed=fine", packages=packages, cwd=packages).returncode == 0


def test_a_name_that_two_plugins_have_is_found_by_the_check_of_one(packages):
    (packages / "other.py").write_text(GOOD.replace("seed/", "seed/other_"))
    write_metadata(packages, "dist-other", "0.4", {"good": "other"})
    done = mvreg("plugins", "check", "dist-other", packages=packages, cwd=packages)
    assert done.returncode == 1
    assert "two plugins are called 'good': one of dist-" in done.stdout


@pytest.mark.parametrize(("hook", "nothing"), [("mvreg_stages", "{}"), ("mvreg_formats", "[]")])
def test_a_plugin_that_brings_nothing_is_said_to(hook, nothing, packages):
    install(packages, "empty", f"def {hook}():\n    return {nothing}\n")
    done = mvreg("plugins", "check", "empty", packages=packages, cwd=packages)
    assert done.returncode == 1
    assert f"it brings something\n    expected {hook} to return something" in done.stdout


def test_a_distribution_without_an_entry_point_is_told_what_it_lacks(packages):
    (packages / "bare.py").write_text(GOOD)
    write_metadata(packages, "mvreg-bare", "0.5", {})
    for name in ("bare", "mvreg-bare"):
        done = mvreg("plugins", "check", name, packages=packages, cwd=packages)
        assert done.returncode == 2
        assert (
            "; mvreg-bare 0.5 is installed, but has no entry point in the group 'mvreg': write "
            "[project.entry-points.mvreg] in its pyproject.toml and install it again; plugins: "
        ) in done.stderr


def test_mvregs_own_stages_are_checked_if_asked():
    found = list(check_plugins("seed=nearest"))
    assert {one.status for one in found} == {Status.passed} and len(found) > 10
    assert {one.subject.origin for one in found} == {manager.stages()["seed/nearest"].origin}
    suite = SUITES["seed"]
    assert len(found) == len([name for name in dir(suite) if name.startswith("test_")])


def test_the_table_has_a_row_for_each_thing():
    first, second = (Subject(name, "p", "dist 1") for name in ("seed=a", "seed=b"))
    found = [
        Outcome(first, "one", Status.passed),
        Outcome(first, "two", Status.failed, "expected [x]; got y"),
        Outcome(second, "one", Status.skipped, "no"),
    ]
    assert table(found).row_count == 2
    lines = findings(found)
    assert (
        "failed: seed=a (plugin 'p', dist 1): two" in lines and "    expected [x]; got y" in lines
    )
    assert lines[-1] == "1 checks passed, 1 failed"
