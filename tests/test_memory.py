"""Memory that goes back to the system."""

import subprocess
import sys

import pytest

#: Large arrays, and things between them that stay; says how much is still taken (MB).
HEAP = """
import numpy as np
from mvreg.memory import give_back_arrays, give_back_holes

if {asked}:
    give_back_arrays()
for _ in range(3):
    np.ones(3 << 20)  # from now on glibc has arrays of 24 MB on its heap
kept, large = [], []
for _ in range(10):
    large += [np.ones(5 << 17) for _ in range(4)]
    kept.append(np.ones(1 << 10))
large.clear()
if {holes}:
    give_back_holes()
pages = int(open("/proc/self/statm").read().split()[1])
print(pages * 4096 >> 20)
"""


def taken(asked=False, holes=False):
    code = HEAP.format(asked=asked, holes=holes)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return int(run.stdout)


@pytest.mark.skipif(sys.platform != "linux", reason="of glibc")
@pytest.mark.parametrize("how", ["asked", "holes"])
def test_that_large_arrays_go_back_to_the_system(how):
    assert taken(**{how: True}) < taken() - 100


@pytest.mark.parametrize("platform", ["win32", "linux"])
def test_that_other_libraries_do_without(monkeypatch, platform):
    from mvreg import memory

    monkeypatch.setattr("sys.platform", platform)
    monkeypatch.setattr("mvreg.memory.ctypes.CDLL", lambda name: object())
    memory.give_back_arrays()
    memory.give_back_holes()
