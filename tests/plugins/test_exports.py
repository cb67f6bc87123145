"""Export formats that plugins bring."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest
from fake_plugins import install, mvreg

from mvreg.errors import InputError, PluginError
from mvreg.export import PointFormat, PoseFormat
from mvreg.export.brought import collect_exports
from mvreg.export.table import BY_NAME
from mvreg.plugins.pluggy_manager import Manager
from mvreg.testing.export import write
from mvreg.testing.placed import placements_of_a_run

COMPONENT = placements_of_a_run().components[0]


def poses(folder, component, placements):
    (folder / "ours.json").write_text(
        json.dumps({n: p.tolist() for n, p in component.poses.items()})
    )
    return ["said"]


OURS = PoseFormat("ours", "ours.json", "poses by name", poses)


def manager(**hooks):
    found = Manager()
    for name, given in hooks.items():
        found.add(SimpleNamespace(mvreg_exports=given), name, f"dist-{name} 1.0")
    return found


def collected(*formats, **named):
    return collect_exports(manager(odd=lambda: list(formats)), BY_NAME, **named)


def test_that_a_plugins_format_is_written(tmp_path):
    assert write(collected(OURS)["ours"], tmp_path, COMPONENT) == ["said"]
    found = json.loads((tmp_path / "ours.json").read_text())
    assert found == {name: pose.tolist() for name, pose in COMPONENT.poses.items()}


def test_that_a_points_format_gets_the_model(tmp_path):
    def count(folder, model):
        (folder / "n.txt").write_text(str(sum(len(c.points) for s in model.scans() for c in s)))
        return []

    write(collected(PointFormat("n", "n.txt", "a count", count))["n"], tmp_path, COMPONENT)
    assert int((tmp_path / "n.txt").read_text()) > 600


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (lambda: 1 / 0, r"'odd' \(dist-odd 1.0\) failed in mvreg_exports\(\): ZeroDivisionError"),
        (lambda: [poses], "'odd' .*mvreg.export.PoseFormat or PointFormat, got "),
        (lambda: [replace(OURS, name="Our format")], "expected a name in small letters"),
        (lambda: [replace(OURS, files="")], "expected files in one line"),
        (lambda: [replace(OURS, summary="two\nlines")], "expected summary in one line"),
        (lambda: [replace(OURS, write=lambda folder: [])],
         r"expected write\(folder, component, placements\) -> list of str, got .*change its param"),
        (lambda: [PointFormat("p", "p", "points", poses)], r"write\(folder, model\)"),
        (lambda: [replace(OURS, write=None)], "got None"),
        (lambda: [replace(OURS, name="tum")], "'tum' is registered twice: by mvreg and by plugin"),
        (lambda: [replace(OURS, name="4x4")], "expected a name in small letters"),
        (lambda: [OURS, OURS], "'ours' is registered twice"),
    ],
)  # fmt: skip
def test_that_what_is_no_format_is_refused_by_name(given, said):
    with pytest.raises(PluginError, match=said):
        collect_exports(manager(odd=given), BY_NAME)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda *_: None, r"export=ours \(plugin 'odd' \(dist-odd 1.0\)\): expected write\(folder, "
         r"component, placements\) -> list of str: .* got None; return \[\] where"),
        (lambda *_: "text", "got str 'text'"),
        (lambda *_: 1 / 0, r"got ZeroDivisionError: division by zero at .*test_exports.py:\d+"),
    ],
)  # fmt: skip
def test_that_a_failing_format_names_its_plugin(wrong, said, tmp_path):
    with pytest.raises(PluginError, match=said):
        write(collected(replace(OURS, write=wrong))["ours"], tmp_path, COMPONENT)


@pytest.mark.parametrize("error", [InputError("no place for it"), PermissionError("not allowed")])
def test_that_errors_about_files_are_left_as_they_are(error, tmp_path):
    def fails(*_):
        raise error

    with pytest.raises(type(error)) as raised:
        write(collected(replace(OURS, write=fails))["ours"], tmp_path, COMPONENT)
    assert raised.value is error


SOURCE = """
from mvreg.export import PoseFormat
from mvreg.io import Format

def good(folder, component, placements):
    (folder / "names.txt").write_text(repr(component.poses), encoding="utf-8")
    return []

def bad(folder, component, placements):
    (folder / "bad.txt").write_text("x")

def stray(folder, component, placements):
    (folder.parent / "stray.txt").write_text("x")
    return []

FORMATS = [PoseFormat("good", "names.txt", "what it looks like", good),
           PoseFormat("bad", "bad.txt", "answers nothing", bad),
           PoseFormat("stray", "stray.txt", "written elsewhere", stray)]

def mvreg_exports():
    return FORMATS

def mvreg_formats():
    return [Format("Mine", (".mine",), lambda path, options: [])]

def mvreg_event(event):
    pass
"""


def test_that_the_command_lists_writes_and_checks_them(tmp_path):
    install(tmp_path, "formats", SOURCE)
    listed = mvreg("export", "--list", packages=tmp_path, cwd=tmp_path)
    assert "  good          names.txt              what it looks like\n" in listed.stdout
    all_of_it = mvreg("plugins", packages=tmp_path, cwd=tmp_path).stdout
    whose = "[plugin 'formats' (dist-formats 0.3)]"
    assert "\nbesides, from plugins:\n" in all_of_it
    assert f"  files ending in .mine: Mine  {whose}\n" in all_of_it
    assert f"  export=good: what it looks like  {whose}\n" in all_of_it
    assert f"  an observer of runs  {whose}\n" in all_of_it
    run = ["dataset=tiny", "dataset.views=2", "+method=fcpma", "store=false", "rerun=false",
           "report=false", "hydra.run.dir=run"]  # fmt: skip
    done = mvreg(*run, "export=[good]", packages=tmp_path, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "tiny_00" in (tmp_path / "run" / "export" / "names.txt").read_text()
    (tmp_path / "run" / "export" / "names.txt").unlink()
    done = mvreg("export", "run", "bad", "good", "tum", packages=tmp_path, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.endswith("return [] where there is nothing to say; written: good, tum\n")
    assert {"names.txt", "tum.txt"} <= {f.name for f in (tmp_path / "run" / "export").iterdir()}
    assert done.stderr.startswith("error: export=bad (plugin 'formats' (dist-formats 0.3)): expect")
    done = mvreg("plugins", "check", "formats", packages=tmp_path, cwd=tmp_path)
    assert done.returncode == 1
    assert "files in the folder that is given, and no other; got ['stray.txt']" in done.stdout
    assert "got None; return [] where there is nothing to say" in done.stdout
    good = mvreg("plugins", "check", "export=good", packages=tmp_path, cwd=tmp_path)
    assert good.returncode == 0, good.stdout
    assert "9 checks passed, 0 failed" in good.stdout
