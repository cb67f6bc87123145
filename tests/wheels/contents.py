"""What a source distribution and a wheel of mvreg must hold, and what they must not."""

from __future__ import annotations

import tarfile
import zipfile
from pathlib import Path, PurePosixPath

#: What the outermost folder of a source distribution holds; all else is in the repository.
OUTERMOST = {
    "CHANGELOG.md", "CITATION.cff", "LICENSE", "MANIFEST.in", "PKG-INFO", "README.md", "conf",
    "mvreg", "mvreg.egg-info", "pyproject.toml", "setup.cfg", "setup.py",
}  # fmt: skip
SOURCES = {".pyx", ".pxd", ".c", ".cpp", ".h"}
COMPILED = {".so", ".pyd"}
#: What is read while running, which no import would miss.
DATA = (
    "mvreg/py.typed", "mvreg/conf/config.yaml", "mvreg/conf/method/auto.yaml",
    "mvreg/kit/templates/seed.py", "mvreg/report/page/page.html", "mvreg/report/page/viewer.js",
)  # fmt: skip


class WrongContentsError(Exception):
    """Something is missing, too much, or does not work."""


def version_of(sdist: Path) -> str:
    """The version in the name of a source distribution."""
    return sdist.name.removeprefix("mvreg-").removesuffix(".tar.gz")


def check_sdist(sdist: Path) -> None:
    """Check that a source distribution has all that builds mvreg, and nothing of the workshop.

    Raises
    ------
    WrongContentsError
        Names what is missing or too much.
    """
    with tarfile.open(sdist) as archive:
        files = [
            PurePosixPath(*PurePosixPath(each.name).parts[1:]) for each in archive if each.isfile()
        ]
    outermost = {file.parts[0] for file in files}
    if outermost != OUTERMOST:
        raise WrongContentsError(
            f"{sdist.name}: missing {sorted(OUTERMOST - outermost)}, "
            f"too much {sorted(outermost - OUTERMOST)}; see MANIFEST.in"
        )
    kernels = {file.stem for file in files if file.suffix == ".pyx"}
    stubs = {file.stem for file in files if file.suffix == ".pyi"}
    if kernels != stubs or not kernels:
        raise WrongContentsError(f"{sdist.name}: kernels {sorted(kernels)}, stubs {sorted(stubs)}")
    if written := [str(file) for file in files if file.suffix in {".c", ".cpp", *COMPILED}]:
        raise WrongContentsError(f"{sdist.name} has what a build leaves: {written}")
    if not any(file.suffix == ".pxd" for file in files):
        raise WrongContentsError(f"{sdist.name} lacks the .pxd files of the kernels")


def check_wheel(wheel: Path) -> None:
    """Check that a wheel has every kernel compiled, presets and licence, and no tests or sources.

    Raises
    ------
    WrongContentsError
        Names what is missing or too much.
    """
    with zipfile.ZipFile(wheel) as archive:
        files = [PurePosixPath(name) for name in archive.namelist() if not name.endswith("/")]
    names = {str(file) for file in files}
    if absent := [name for name in DATA if name not in names]:
        raise WrongContentsError(f"{wheel.name} lacks {absent}")
    stubs = {file.stem for file in files if file.suffix == ".pyi"}
    compiled = {file.name.partition(".")[0] for file in files if file.suffix in COMPILED}
    if not stubs or not stubs <= compiled:
        raise WrongContentsError(f"{wheel.name} lacks kernels: {sorted(stubs - compiled)}")
    if found := [str(file) for file in files if file.suffix in SOURCES or "tests" in file.parts]:
        raise WrongContentsError(f"{wheel.name} has what is of no use to who installs it: {found}")
    tops = {file.parts[0].removesuffix(".libs") for file in files}
    if {top for top in tops if not top.endswith(".dist-info")} != {"mvreg"}:
        raise WrongContentsError(f"{wheel.name} installs more than mvreg: {sorted(tops)}")
    if not any(name.endswith(".dist-info/licenses/LICENSE") for name in names):
        raise WrongContentsError(f"{wheel.name} lacks the licence")
