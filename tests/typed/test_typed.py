"""A small program of a user's: its types hold under mypy --strict, and nothing warns."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import mvreg

PROGRAM = Path(__file__).with_name("program.py")

WRONG = {
    "mvreg.register(3)": "arg-type",
    "mvreg.register([object()])": "list-item",
    "mvreg.register([], progress=3)": "arg-type",
    "mvreg.Scan('s', 3.5 + object())": "operator",
    "mvreg.register([]).pose": "attr-defined",
    "x: int = mvreg.register([]).reference": "assignment",
}


def strict(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Check a program as its author would, whose own mypy knows nothing of ours."""
    options = ["--strict", "--config-file=", "--follow-imports=silent"]
    # An editable installation, as the tests have it, is none that mypy sees.
    environment = {**os.environ, "MYPYPATH": str(Path(mvreg.__file__).parents[1])}
    return subprocess.run(
        [sys.executable, "-m", "mypy", *options, *words], env=environment, capture_output=True,
        text=True, check=False, cwd=cwd,
    )  # fmt: skip


def test_types_hold_in_a_users_program_and_mistakes_are_found(tmp_path):
    lines = ["import mvreg", *WRONG]
    (tmp_path / "wrong.py").write_text("\n".join(lines) + "\n")
    (tmp_path / "program.py").write_text(PROGRAM.read_text())
    done = strict("program.py", "wrong.py", cwd=tmp_path)
    found = [line for line in done.stdout.splitlines() if "error:" in line]
    assert [line for line in found if not line.startswith("wrong.py")] == []
    for number, (line, code) in enumerate(WRONG.items(), 2):
        assert any(f"wrong.py:{number}: error" in e and f"[{code}]" in e for e in found), (
            f"{line}: expected the error {code!r} of mypy, got {done.stdout}"
        )


@pytest.mark.parametrize("flags", [["-W", "error"], ["-W", "error", "-X", "dev"]], ids=str)
def test_the_program_runs_where_warnings_are_errors(flags, tmp_path):
    done = subprocess.run(
        [sys.executable, *flags, str(PROGRAM)], capture_output=True, text=True, check=False,
        cwd=tmp_path, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    printed = done.stdout.splitlines()
    assert sorted(line.split()[0] for line in printed[:3]) == ["rows", "single", "table"]
    assert printed[3].startswith("refused: ") and printed[3].endswith(
        "expected at least two scans with different names, got 1 scan(s)"
    )
    assert "prepare: 0 of 3" in done.stderr and "adjust: 3 of 3" in done.stderr
