"""The one place where Open3D is imported: it is slow to load, and needs help on bare machines."""

from __future__ import annotations

import ctypes
import sys
import warnings
from types import ModuleType

from mvreg import tbb
from mvreg.errors import MvregError
from mvreg.parallel import threads

#: Open3D, once its threads are limited.
_LIMITED: list[ModuleType] = []
_LIBUSB = "libusb-1.0.so.0"


def load_open3d() -> ModuleType:
    """Import Open3D, which takes about a second, and return the module.

    It uses as many threads as mvreg does, see `mvreg.parallel.threads`; by itself it would take
    every core, since it is built on oneTBB, which does not go by OMP_NUM_THREADS.

    Open3D's Linux wheels are linked against libusb-1.0, which a bare Debian lacks and only root
    can install. Where the system has none, the copy in the package ``libusb_package`` is loaded
    first: the dynamic linker then takes it for the library that Open3D asks for.

    Raises
    ------
    MvregError
        If Open3D or its libraries cannot be loaded; says what to install.
    """
    if sys.platform == "linux":
        _preload_libusb()
    try:
        with warnings.catch_warnings():
            # Its own dependencies warn about each other; nobody here can act on that.
            warnings.simplefilter("ignore")
            import open3d
    except (ImportError, OSError) as error:
        raise MvregError(
            f"Open3D cannot be imported: {error}. Install it with: pip install mvreg "
            "(on Linux also the system's libusb-1.0, libgl1 and libgomp1 where they are missing)"
        ) from error
    module: ModuleType = open3d
    if not _LIMITED:
        tbb.limit(module, threads())
        _LIMITED.append(module)
    return module


def _preload_libusb() -> None:
    """Make libusb known to the linker; what is still missing, the import itself will report."""
    try:
        ctypes.CDLL(_LIBUSB, mode=ctypes.RTLD_GLOBAL)
    except OSError:
        try:
            import libusb_package

            ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
        except (ImportError, OSError):
            return
