"""What pyproject.toml cannot say: how kernels are compiled, and which version this is."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

if TYPE_CHECKING:
    from setuptools_scm import ScmVersion

#: The version of a copy without git or its tags: of what the next release will be.
NEXT = "0.1.0.dev0"

#: No fused multiplications: the same sums on every machine. Square roots set no errno, and no trap
#: is minded: what a loop then leaves out may be computed, several at a time. No symbols for a
#: debugger: they would be five sixths of the size.
UNIX = ["-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-g0", "-pthread"]
#: The same of Microsoft's compiler, which fuses nothing without /arch:AVX2.
MSVC = ["/O2", "/fp:precise", "/EHsc", "/utf-8"]


class BuildKernels(build_ext):
    """Compile on all cores, with flags that the compiler knows."""

    def build_extensions(self) -> None:
        from Cython.Build import cythonize

        cores = os.cpu_count() or 1
        workers = cores if sys.platform == "linux" else 0  # elsewhere processes are not forked
        # What Cython writes stays out of the sources.
        written = cythonize(
            self.extensions, force=bool(self.force), build_dir=self.build_temp, nthreads=workers
        )
        windows = self.compiler.compiler_type == "msvc"
        for extension, translated in zip(self.extensions, written, strict=True):
            extension.sources = translated.sources
            extension.extra_compile_args = MSVC if windows else UNIX
            extension.extra_link_args = [] if windows else ["-pthread"]
        self.parallel = self.parallel or cores
        super().build_extensions()


def version_of(found: ScmVersion) -> str:
    """A tag's own version at the tag, and the next minor one's ``.dev0`` anywhere after it.

    It does not count commits: an editable installation keeps the version that it was made with, and
    would tell of another commit than it runs. Reports name the commit.
    """
    if found.exact or found.tag.is_devrelease:  # no tag: NEXT takes its place
        return str(found.tag)
    major, minor = found.tag.release[:2]
    return f"{major}.{minor + 1}.0.dev0"


setup(
    use_scm_version={
        "version_scheme": version_of,
        "local_scheme": "no-local-version",
        "fallback_version": NEXT,
    },
    ext_modules=[
        Extension(f"mvreg.kernels.{file.stem}", [file.as_posix()], language="c++")
        for file in sorted(Path("mvreg", "kernels").glob("*.pyx"))
    ],
    cmdclass={"build_ext": BuildKernels},
)
