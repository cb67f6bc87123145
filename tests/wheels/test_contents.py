"""What is published is checked for what it must hold; and the source distribution as it is now."""

import io
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from contents import DATA, WrongContentsError, check_sdist, check_wheel, version_of

ROOT = Path(__file__).parents[2]
WHEEL = {
    *DATA, "mvreg/kernels/icp.pyi", "mvreg/kernels/icp.cpython-311-x86_64-linux-gnu.so",
    "mvreg-1.2.3.dist-info/METADATA", "mvreg-1.2.3.dist-info/licenses/LICENSE",
}  # fmt: skip


def wheel_of(folder, names):
    file = folder / "mvreg-1.2.3-cp311-cp311-linux_x86_64.whl"
    with zipfile.ZipFile(file, "w") as archive:
        for name in sorted(names):
            archive.writestr(name, "")
    return file


def changed(sdist, folder, without=(), more=()):
    """A copy of a source distribution with some files fewer and some more."""
    file = folder / sdist.name
    with tarfile.open(sdist) as old, tarfile.open(file, "w:gz") as new:
        for each in old:
            if each.isfile() and not each.name.endswith(tuple(without)):
                new.addfile(each, old.extractfile(each))
        for name in more:
            new.addfile(
                tarfile.TarInfo(f"{sdist.name.removesuffix('.tar.gz')}/{name}"), io.BytesIO()
            )
    return file


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    """The source distribution of this checkout."""
    pytest.importorskip("setuptools_scm")
    folder = tmp_path_factory.mktemp("dist")
    done = subprocess.run(
        [sys.executable, "setup.py", "-q", "sdist", "--formats=gztar", "-d", str(folder)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (file,) = folder.iterdir()
    return file


def test_the_source_distribution_builds_mvreg_and_has_no_more(sdist):
    check_sdist(sdist)
    assert version_of(sdist)[0].isdigit()


@pytest.mark.parametrize(
    ("without", "more", "said"),
    [
        ([".pxd"], [], "lacks the .pxd"),
        (["icp.pyx"], [], "kernels"),
        (["setup.py"], [], "missing .*setup.py"),
        ([], ["tests/test_a.py"], "too much .*tests"),
        ([], ["mvreg/kernels/icp.cpp"], "a build leaves"),
    ],
)
def test_a_wrong_source_distribution_is_found(sdist, tmp_path, without, more, said):
    with pytest.raises(WrongContentsError, match=said):
        check_sdist(changed(sdist, tmp_path, without, more))


def test_a_wheel_is_complete(tmp_path):
    check_wheel(wheel_of(tmp_path, WHEEL))
    check_wheel(wheel_of(tmp_path, {*WHEEL, "mvreg.libs/msvcp140.dll"}))


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (WHEEL - {"mvreg/py.typed"}, "py.typed"),
        (WHEEL - {"mvreg/conf/method/auto.yaml"}, "auto.yaml"),
        ({name for name in WHEEL if not name.endswith(".so")}, "lacks kernels: .*icp"),
        (WHEEL | {"mvreg/kernels/tree.pyi"}, "lacks kernels: .*tree"),
        (WHEEL | {"mvreg/kernels/icp.cpp"}, "of no use"),
        (WHEEL | {"mvreg/tests/test_a.py"}, "of no use"),
        (WHEEL | {"experiments/a.py"}, "more than mvreg"),
        (WHEEL - {"mvreg-1.2.3.dist-info/licenses/LICENSE"}, "licence"),
    ],
)
def test_a_wrong_wheel_is_found(tmp_path, names, said):
    with pytest.raises(WrongContentsError, match=said):
        check_wheel(wheel_of(tmp_path, names))
