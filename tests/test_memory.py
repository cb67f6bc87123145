"""Memory that goes back to the system."""

import subprocess
import sys

import pytest

#: Large arrays are freed in the order in which a heap cannot give them back: a small one is left
#: behind each. Says how much is still taken (MB).
HEAP = """
import numpy as np
from mvreg.memory import give_back_arrays

if {asked}:
    give_back_arrays()
for _ in range(3):
    np.ones(3 << 20)  # from now on glibc has arrays of 24 MB on its heap
kept = []
for _ in range(10):
    large = [np.ones(5 << 17) for _ in range(4)]
    kept.append(np.ones(1 << 10))
    del large
large = [(np.ones(5 << 17), kept.append(np.ones(1 << 12))) for _ in range(20)]
del large
pages = int(open("/proc/self/statm").read().split()[1])
print(pages * 4096 >> 20)
"""


def taken(asked):
    code = HEAP.format(asked=asked)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return int(run.stdout)


@pytest.mark.skipif(sys.platform != "linux", reason="of glibc")
def test_that_large_arrays_go_back_to_the_system():
    assert taken(True) < taken(False) - 30
