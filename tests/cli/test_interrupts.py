"""Ctrl-C ends a process with 130; ``python -m experiments.bench.interrupts`` tries many moments."""

import os
import signal
import subprocess
import sys
import textwrap

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are sent as POSIX has them")


@pytest.fixture(autouse=True)
def heeded():
    """Let children heed Ctrl-C, even if the tests themselves were started in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


#: Ctrl-C comes where `{moment}` says, while the command line does what `{body}` says.
PROGRAM = """
import os, signal, sys, weakref
from mvreg import __main__
from mvreg.cli import main as cli

def ctrl_c():
    os.kill(os.getpid(), signal.SIGINT)

def body(words=None):
{body}
    return 0

{where} = body
sys.exit(__main__.main())
"""
BODIES = {
    "in a run": ("cli.dispatch", "    ctrl_c()"),
    "outside of it": ("cli.main", "    ctrl_c()"),
    "while a string is executed": ("cli.dispatch", "    exec('ctrl_c()', globals())"),
    "and comes out as another error": (
        "cli.dispatch",
        "    try:\n        ctrl_c()\n    except KeyboardInterrupt:\n"
        "        raise ImportError('initialization failed')",
    ),
    "where Python cannot raise": (
        "cli.dispatch",
        "    class Thing: pass\n    thing = Thing()\n"
        "    weakref.finalize(thing, print)\n"
        "    kept = weakref.ref(thing, lambda _: ctrl_c())\n    del thing\n"
        "    import time\n    time.sleep(5)",
    ),
    "and is passed over": (
        "cli.dispatch",
        "    try:\n        ctrl_c()\n    except BaseException:\n        pass",
    ),
    "twice": (
        "cli.dispatch",
        "    try:\n        ctrl_c()\n    finally:\n        ctrl_c()",
    ),
    "and a library ends with a code of its own": (  # as Open3D does, imported in part
        "cli.dispatch",
        "    import ctypes\n    libc = ctypes.CDLL(None)\n"
        "    getattr(libc, '__cxa_atexit')(ctypes.cast(libc.abort, ctypes.c_void_p), None, None)\n"
        "    ctrl_c()",
    ),
}


@pytest.mark.parametrize("moment", BODIES)
def test_ctrl_c_ends_with_130(moment):
    where, body = BODIES[moment]
    program = PROGRAM.format(where=where, body=textwrap.indent(textwrap.dedent(body), "    "))
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 130, done.stderr
    assert "Traceback" not in done.stderr


def test_ctrl_c_while_the_command_line_is_imported():
    program = (
        "import os, signal, sys\n"
        "class Finder:\n"
        "    def find_spec(name, path=None, target=None):\n"
        "        if name == 'mvreg.cli.main':\n"
        "            os.kill(os.getpid(), signal.SIGINT)\n"
        "from mvreg import __main__\n"
        "sys.meta_path.insert(0, Finder)\n"
        "sys.exit(__main__.main())"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


def test_libraries_tidy_up_after_ctrl_c():
    body = "    import atexit\n    atexit.register(sys.stderr.write, 'tidied up\\n')\n    ctrl_c()"
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(where="cli.dispatch", body=body)],
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "interrupted\ntidied up\n")


def test_ctrl_c_that_is_ignored_stays_ignored():
    program = PROGRAM.format(where="cli.dispatch", body="    ctrl_c()")
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=120,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_importing_mvreg_listens_to_nothing():
    program = (
        "import signal, sys, mvreg, mvreg.__main__, mvreg.cli.main; mvreg.register; "
        "sys.exit(signal.getsignal(signal.SIGINT) is not signal.default_int_handler)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False, timeout=60).returncode == 0
