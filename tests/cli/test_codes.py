"""Exit codes of jobs, also of those in other processes, and what a killed run leaves behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from mvreg.cli.codes import CODES, add_code, collected_codes, shared_file

#: Collects codes, says so, and waits to be killed.
WAITING = """
import time
from mvreg.cli.codes import add_code, collected_codes
with collected_codes():
    add_code(3)
    print("ready", flush=True)
    time.sleep(60)
"""


def elsewhere(code):
    said = f"from mvreg.cli.codes import add_code; add_code({code})"
    subprocess.run([sys.executable, "-c", said], check=True)


def test_that_codes_of_all_processes_are_collected():
    with collected_codes() as codes:
        add_code(0)
        elsewhere(3)
        add_code(130)
    assert codes == [0, 3, 130]
    assert CODES not in os.environ


def test_that_jobs_that_outlive_their_run_end_well(monkeypatch):
    with shared_file() as file:
        monkeypatch.setenv(CODES, str(file))
    elsewhere(0)


def test_that_a_folder_will_do_where_files_in_memory_are_unknown(monkeypatch, tmp_path):
    monkeypatch.delattr(os, "memfd_create", raising=False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with collected_codes() as codes:
        assert len([*tmp_path.iterdir()]) == 1
        elsewhere(2)
    assert codes == [2]
    assert not [*tmp_path.iterdir()]


@pytest.mark.skipif(not hasattr(os, "memfd_create"), reason="files in memory are Linux's")
@pytest.mark.parametrize("killer", [signal.SIGTERM, signal.SIGKILL])
def test_that_a_killed_run_leaves_nothing_in_the_temporary_folder(tmp_path, killer):
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    with subprocess.Popen(
        [sys.executable, "-c", WAITING], env=environment, stdout=subprocess.PIPE, text=True
    ) as run:
        assert run.stdout.readline() == "ready\n"
        run.send_signal(killer)
        assert run.wait() == -killer
    assert not [*tmp_path.iterdir()]
