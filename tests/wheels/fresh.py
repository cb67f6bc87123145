"""Check what would be published: contents, and how it runs where no compiler and no checkout is.

    python tests/wheels/fresh.py dist

``dist`` has one source distribution of mvreg, wheels of mvreg for this Python and perhaps others,
and one of each plugin. They are installed into a new environment, in a temporary folder, and mvreg
registers scans there. Needs pip, a network and 1 GB; `make wheel` builds first.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Iterator
from pathlib import Path

from contents import WrongContentsError, check_sdist, check_wheel, version_of

#: Seconds that a start may take at best.
IMPORT, HELP = 0.1, 0.5
ROUNDS = 11
#: What is run, by each installed plugin's own words; all register the small scans.
RUNS = (
    ("dataset=figurine",),
    ("+method=fcpma", "dataset=tiny"),
    ("+method=surfc", "dataset=tiny"),  # mvreg-comparators
    ("describe=fpfh", "dataset=tiny"),  # mvreg-fpfh
    ("+method=open3d_multiway", "dataset=tiny"),  # mvreg-peers
)
PLUGINS = ("mvreg-comparators", "mvreg-fpfh", "mvreg-peers")


class Environment:
    """A new environment in `folder`, whose programs find no compiler."""

    def __init__(self, folder: Path) -> None:
        venv.create(folder / "venv")
        inside = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
        self.python = inside / ("python.exe" if os.name == "nt" else "python")
        self.programs = inside
        #: A name that one must quote, and no checkout above it.
        self.elsewhere = folder / "some scans"
        self.elsewhere.mkdir()
        system = [r"C:\Windows\System32"] if os.name == "nt" else []
        kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "MVREG_"))}
        self.variables = kept | {
            "PATH": os.pathsep.join([str(inside), *system]),
            "CC": "no-compiler", "CXX": "no-compiler",
        }  # fmt: skip

    def install(self, dist: Path, *what: str) -> None:
        """By the pip of this Python, from wheels of ours; dependencies come from the registry."""
        words = ["--python", str(self.python), "install", "--quiet", "--find-links", str(dist)]
        ours = ",".join(["mvreg", *PLUGINS])
        subprocess.run(
            [sys.executable, "-m", "pip", *words, "--only-binary", ours, *what],
            cwd=self.elsewhere, env=self.variables, check=True,
        )  # fmt: skip

    def run(self, *words: str, program: str | None = "mvreg") -> str:
        """Standard output of a program of the environment, or of its Python."""
        first = self.python if program is None else self.programs / program
        found = subprocess.run(
            [str(first), *words], cwd=self.elsewhere, env=self.variables, check=False,
            capture_output=True, text=True, encoding="utf-8", errors="replace", timeout=900,
        )  # fmt: skip
        if found.returncode:
            said = f"{found.stdout}\n{found.stderr}"
            raise WrongContentsError(f"{program or 'python'} {' '.join(words)} failed:\n{said}")
        return found.stdout


def expect(what: str, found: object, wanted: object) -> None:
    """Say what was found, or what should have been.

    Raises
    ------
    WrongContentsError
        If these differ.
    """
    if found != wanted:
        raise WrongContentsError(f"{what}: expected {wanted!r}, found {found!r}")
    print(f"{what}: {found}")


def check_names(environment: Environment, version: str) -> None:
    """Version, place and plugins."""
    expect("mvreg --version", environment.run("--version").strip(), f"mvreg {version}")
    code = "import mvreg; print(mvreg.__version__); print(mvreg.__file__)"
    told, file = environment.run("-c", code, program=None).splitlines()
    expect("mvreg.__version__", told, version)
    inside = environment.python.parent.parent.resolve() in Path(file).resolve().parents
    expect("it is the installed one", inside, True)
    stages = environment.run("plugins")
    expect("mvreg plugins names", [name for name in PLUGINS if name in stages], list(PLUGINS))


def check_runs(environment: Environment) -> None:
    """Scans are registered, all of them."""
    for words in RUNS:
        start = time.perf_counter()
        environment.run(*words)
        seconds = time.perf_counter() - start
        newest = max(environment.elsewhere.rglob("result.json"), key=lambda f: f.stat().st_mtime)
        report = json.loads(newest.read_text(encoding="utf-8"))
        expect(f"mvreg {' '.join(words)}, not placed", report["unregistered"], [])
        print(f"  {len(report['poses'])} scans in {seconds:.1f} s")
        expect("  commit of the checkout", report["commit"], None)


def times(environment: Environment, *words: str) -> Iterator[float]:
    """Seconds, from the outside, of a start after the other."""
    for _ in range(ROUNDS):
        start = time.perf_counter()
        environment.run(*words)
        yield time.perf_counter() - start


def check_start(environment: Environment) -> None:
    """How long Python takes to import mvreg, and mvreg to tell its help; files are read by then."""
    code = "import time; t = time.perf_counter(); import mvreg; print(time.perf_counter() - t)"
    imports = [float(environment.run("-c", code, program=None)) for _ in range(ROUNDS)]
    helps = list(times(environment, "--help"))
    for what, seconds, limit in (("import mvreg", imports, IMPORT), ("mvreg --help", helps, HELP)):
        print(f"{what}: median {statistics.median(seconds):.3f} s, least {min(seconds):.3f}")
        if min(seconds) > limit:  # others on the machine lengthen the median more than the least
            raise WrongContentsError(f"{what} takes {min(seconds):.3f} s at least, not {limit}")


def main(dist: Path) -> int:
    """Check everything in `dist`, and return the exit code."""
    try:
        (sdist,) = dist.glob("mvreg-*.tar.gz")
        version = version_of(sdist)
        check_sdist(sdist)
        wheels = sorted(dist.glob(f"mvreg-{version}-*.whl"))
        for wheel in wheels:
            check_wheel(wheel)
        print(f"contents of {sdist.name} and of {len(wheels)} wheels are as they should be")
        with tempfile.TemporaryDirectory(prefix="mvreg-fresh-") as folder:
            environment = Environment(Path(folder))
            environment.install(dist, f"mvreg=={version}", *map(str, dist.glob("mvreg_*.whl")))
            check_names(environment, version)
            check_runs(environment)
            check_start(environment)
    except WrongContentsError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
