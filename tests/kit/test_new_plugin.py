"""``mvreg new-plugin``: what it writes installs, passes its own tests and is nobody else's."""

import ast
import subprocess
import sys
import tomllib

import pytest
from fake_plugins import mvreg, plugin_with, python, use
from test_public import private

from mvreg.contracts import KINDS
from mvreg.errors import InputError
from mvreg.kit.naming import BESIDES, checked_naming
from mvreg.kit.new import new_plugin
from mvreg.stages import NearestSeed

EVERY = (*KINDS, *BESIDES)
#: A new plugin of one kind is installed in every run of the tests, those of the others in the last.
QUICK = "seed"


@pytest.mark.parametrize(
    "kind", [k if k == QUICK else pytest.param(k, marks=pytest.mark.slow) for k in EVERY]
)
def test_a_new_plugin_is_installed_and_passes_its_tests(kind, tmp_path):
    folder, _ = new_plugin("my_own", kind, tmp_path)
    packages = tmp_path / "packages"
    pip = ["-m", "pip", "install", "--no-deps", "--no-build-isolation", "--no-index", "--quiet",
           "--disable-pip-version-check", "--target", str(packages), str(folder)]  # fmt: skip
    done = python(*pip, cwd=tmp_path, packages=packages, timeout=300)
    assert done.returncode == 0, done.stderr
    tests = folder / "tests"
    done = python(
        "-m", "pytest", "-q", "-n", "0", "-p", "no:dash", "-p", "no:cacheprovider", "-W", "error",
        "--rootdir", str(tests), str(tests), cwd=tmp_path, packages=packages, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    done = mvreg("plugins", "check", "my_own", packages=packages, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "mvreg-my-own 0.1.0" in done.stdout and " 0 failed" in done.stdout


@pytest.mark.parametrize("kind", EVERY)
def test_what_is_written_is_a_whole_distribution(kind, tmp_path):
    folder, files = new_plugin("abc", kind, tmp_path / "new" / "folder")
    assert sorted(files) == sorted(
        path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()
    )
    assert [path.name for path in folder.parent.iterdir()] == ["mvreg-abc"]
    project = tomllib.loads((folder / "pyproject.toml").read_text())
    assert project["project"]["entry-points"]["mvreg"] == {"abc": "mvreg_abc"}
    for package in project["tool"]["setuptools"]["packages"]:
        assert (folder / package.replace(".", "/") / "__init__.py").is_file()
    for file in folder.rglob("*"):
        if file.is_file():
            text = file.read_text()
            assert "nameless" not in text.lower(), file
            assert file.suffix != ".py" or ast.parse(text) is not None
    sources = [file.read_text() for file in (folder / "mvreg_abc").rglob("*.py")]
    assert [private(source) for source in sources] == [set()] * len(sources)
    assert (
        f"mvreg_abc/{'stage' if kind in KINDS else kind}.py" in (folder / "README.md").read_text()
    )
    assert ("conf" in {path.name for path in (folder / "mvreg_abc").iterdir()}) == (kind in KINDS)


def test_it_is_linted_as_it_is_written(tmp_path):
    for kind in EVERY:
        new_plugin(f"my_{kind}", kind, tmp_path)
    words = [sys.executable, "-m", "ruff", "check", "--isolated", "--no-cache", "--select",
             "E,F,W,UP,B,SIM,RUF", "--line-length", "110", "--target-version", "py311",
             str(tmp_path)]  # fmt: skip
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_nothing_is_overwritten(tmp_path):
    new_plugin("abc", "seed", tmp_path)
    file = tmp_path / "mvreg-abc" / "README.md"
    file.write_text("mine")
    with pytest.raises(InputError, match="mvreg-abc is there already; move it away, or choose ano"):
        new_plugin("abc", "judge", tmp_path)
    assert file.read_text() == "mine"
    (tmp_path / "mvreg-def").symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match="is there already"):
        new_plugin("def", "seed", tmp_path)


@pytest.mark.parametrize(
    ("name", "kind", "said"),
    [
        ("My-Seed", "seed", "'My-Seed' cannot be the name .* with a letter, such as 'my_seed'"),
        ("3d", "seed", "expected small letters, digits and single underscores"),
        ("a b", "seed", "such as 'a_b'"),
        ("", "seed", "'' cannot be the name of a plugin"),
        ("../up", "seed", "such as 'up'"),
        ("a__b", "seed", "such as 'a_b'"),
        ("a" * 31, "seed", "a name of at most 30 letters, got 31"),
        ("nearest", "seed", r"seed=nearest is taken by plugin 'mvreg' \(mvreg "),
        ("auto", "seed", "there is a preset method=auto already"),
        ("bunny", "dataset", "there is a preset dataset=bunny already"),
        ("comparators", "seed", "a plugin of mvreg-comparators .* is called 'comparators' already"),
        ("mvreg", "seed", "a plugin of mvreg .* is called 'mvreg' already; choose another"),
        ("ply", "reader", "files ending in .ply are read already, as PLY; choose another name"),
        ("mine", "seeds", "'seeds' is not a kind of plugin: expected one of .*mean 'seed'"),
        ("ply", "exporter", "there is an export format 'ply' already; choose another name"),
        ("mine", "export", "did you mean 'exporter'"),
        ("mine", "nonsense", "expected one of dataset, .*, reader, exporter, observer$"),
    ],
)
def test_what_cannot_be_a_name_or_a_kind_is_refused_in_words(name, kind, said, tmp_path):
    with pytest.raises(InputError, match=said):
        new_plugin(name, kind, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_name_that_another_plugin_has_is_refused_with_its_owner(monkeypatch):
    use(monkeypatch, other=plugin_with({"seed/mine": NearestSeed}))
    with pytest.raises(InputError, match=r"seed=mine is taken by plugin 'other' \(dist-other 0.3"):
        checked_naming("mine", "seed")
    assert checked_naming("mine", "judge").cls == "MineJudge"


def test_the_command_says_what_it_wrote_and_what_is_next(tmp_path):
    done = mvreg("new-plugin", "my_seed", "seed", "--to", "here it is", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "here it is/mvreg-my-seed/mvreg_my_seed/stage.py").is_file()
    assert "  mvreg_my_seed/stage.py\n" in done.stdout
    assert "  pip install -e 'here it is/mvreg-my-seed'\n" in done.stdout
    done = mvreg("new-plugin", "my_seed", "seed", "--to", "here it is", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == (
        "error: here it is/mvreg-my-seed is there already; move it away, or choose another name\n"
    )
    done = mvreg("new-plugin", "my_seed", cwd=tmp_path)
    assert done.returncode == 2 and "kind" in done.stderr


def test_a_package_that_is_installed_is_not_shadowed(monkeypatch, tmp_path):
    (tmp_path / "mvreg_mine").mkdir()
    (tmp_path / "mvreg_mine" / "__init__.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InputError, match=r"a package mvreg_mine is installed already; .* pip un"):
        checked_naming("mine", "seed")
