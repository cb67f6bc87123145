"""Which version a checkout has, by git's tags and without them."""

import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import mvreg

setuptools = pytest.importorskip("setuptools")
setuptools_scm = pytest.importorskip("setuptools_scm")

ROOT = Path(__file__).parents[2]
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def settings():
    """What setup.py hands to setuptools."""
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(setuptools, "setup", lambda **words: found.update(words))
        patch.chdir(ROOT)
        patch.setattr(sys, "path", [*sys.path])
        runpy.run_path(str(ROOT / "setup.py"))
    return found


@pytest.fixture
def checkout(tmp_path):
    """A repository with one commit; called with words, git does what they say."""
    if shutil.which("git") is None:
        pytest.skip("needs git")

    def git(*words):
        name = ("-c", "user.name=test", "-c", "user.email=test@example.org")
        subprocess.run(["git", *name, *words], cwd=tmp_path, check=True, capture_output=True)

    git("init", "-q")
    git("commit", "-q", "--allow-empty", "-m", "one")
    return git


@pytest.fixture
def version(settings, tmp_path):
    return lambda: setuptools_scm.get_version(root=tmp_path, **settings["use_scm_version"])


def next_version(settings):
    return settings["use_scm_version"]["fallback_version"]


def test_a_folder_without_git_has_the_next_version(settings, version):
    assert version() == next_version(settings)


def test_a_checkout_without_tags_has_the_next_version(settings, checkout, version):
    assert version() == next_version(settings)


def test_at_a_tag_it_is_the_tags_and_between_two_it_stays_the_same(checkout, version):
    checkout("tag", "v1.2.3")
    assert version() == "1.2.3"
    for _ in range(2):
        checkout("commit", "-q", "--allow-empty", "-m", "more")
        assert version() == "1.3.0.dev0"
    checkout("tag", "v2.0.0rc1")
    assert version() == "2.0.0rc1"


def test_the_next_version_is_the_one_that_the_changelog_collects_for(settings):
    newest = re.findall(r"^## \[([^]]+)\]", CHANGELOG, re.MULTILINE)[0]
    assert next_version(settings) == f"{newest}.dev0"


def test_every_kernel_is_compiled(settings):
    kernels = {file.stem for file in (ROOT / "mvreg" / "kernels").glob("*.pyx")}
    assert {each.name for each in settings["ext_modules"]} == {
        f"mvreg.kernels.{k}" for k in kernels
    }
    assert len(settings["ext_modules"]) == len(kernels) > 0


def test_the_version_is_the_installed_ones():
    assert re.fullmatch(r"\d+\.\d+\.\d+(rc\d+|\.dev0)?", mvreg.__version__)


def test_the_citation_names_a_version_of_the_changelog():
    (cited,) = re.findall(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert cited in re.findall(r"^## \[([^]]+)\]", CHANGELOG, re.MULTILINE)


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", "INSTALL.md", "SECURITY.md"])
def test_what_the_house_documents_name_is_there(name):
    text = (ROOT / name).read_text()
    files = re.findall(r"\]\(([^)#]+)\)|`((?:mvreg|tests|experiments|conf)/[\w/.]+)`", text)
    named = [a or b for a, b in files if not re.search("KIND|NAME", b)]
    assert [each for each in named if not (ROOT / each).exists()] == []
