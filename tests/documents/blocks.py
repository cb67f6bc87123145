"""What a page of the documentation has its reader type, and what it says will be printed.

In ``docs/**/*.md``, below a comment that says so, a block of code is special:

``<!-- file: NAME -->``
    The reader writes this file.
``<!-- include: FILE -->``
    The block is a file of the repository, see `include.py`, which the reader has.
``<!-- not run: REASON -->``
    A command or code that cannot be run here, such as one for a cluster.

Each line of any other ``sh`` block is a command, which ends with 0, or as its comment says:
``# ends with 3``. A ``python`` block is a program. A ``text`` block below either shows some of the
lines that it printed; their numbers may differ.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

from fake_plugins import write_metadata

BLOCK = re.compile(
    r"(?:^<!-- (file|include|not run): ([^\n]*?) -->\n)?^```(\w*)\n(.*?)^```$",
    re.DOTALL | re.MULTILINE,
)
ENDS = re.compile(r"#.*\bends with (\d)")
#: What pages call the folder in which all this is done.
HOME = "/home/me"
NUMBER = re.compile(r"-?\d[\d,]*(\.\d+)?(e[-+]?\d+)?")


@dataclass(frozen=True)
class Block:
    """A block of code: its language, its text, and the comment before it, if it is special."""

    language: str
    text: str
    special: str = ""
    argument: str = ""


def blocks_of(page: str) -> list[Block]:
    """The blocks of code of a page, in order."""
    return [Block(m[3], m[4], m[1] or "", m[2] or "") for m in BLOCK.finditer(page)]


def commands_of(block: Block) -> list[tuple[str, int]]:
    """The commands of a block and the exit codes that they are to end with."""
    lines = block.text.replace("\\\n", " ").splitlines()
    found = []
    for line in lines:
        ends = ENDS.search(line)
        command = re.sub(r"(^|\s)#.*$", "", line).strip()
        if command:
            found.append((command, int(ends[1]) if ends else 0))
    return found


def follow(page: Path, desk: Path) -> int:
    """Do what a page says in a folder; returns how many blocks that was."""
    printed, done = "", 0
    for block in blocks_of(page.read_text("utf-8")):
        if block.special in ("file", "include"):
            (desk / block.argument).parent.mkdir(parents=True, exist_ok=True)
            (desk / block.argument).write_text(block.text, "utf-8")
            if block.argument.endswith("pyproject.toml"):
                install(desk / block.argument)
        elif block.special:
            continue
        elif block.language == "sh":
            printed = "".join(run(*each, desk) for each in commands_of(block))
        elif block.language == "python":
            printed = called([sys.executable, "-c", block.text], 0, desk)
        elif block.language == "text":
            check_printed(block.text, printed)
        else:
            continue
        done += 1
    return done


def install(file: Path) -> None:
    """Let the project of a ``pyproject.toml`` be known, as ``pip install -e`` would."""
    project = tomllib.loads(file.read_text("utf-8"))["project"]
    write_metadata(
        file.parent, project["name"], project["version"], project["entry-points"]["mvreg"]
    )


def run(command: str, code: int, desk: Path) -> str:
    """Run one command, which must be of mvreg or of Python."""
    program, *rest = shlex.split(command)
    assert program in ("mvreg", "python", "pytest"), f"unknown to the tests: {command}"
    start = [sys.executable] if program == "python" else [sys.executable, "-m", program]
    return called([*start, *rest], code, desk)


def called(words: list[str], code: int, desk: Path) -> str:
    """What a command prints, on both channels, if it ends as it should."""
    plugins = [str(file.parent) for file in desk.glob("*/pyproject.toml")]
    path = os.pathsep.join([*plugins, *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        words, cwd=desk, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True,
        timeout=600, check=False,
    )  # fmt: skip
    said = f"{done.stdout}\n{done.stderr}".replace(str(desk), HOME)
    assert done.returncode == code, f"{words} ended with {done.returncode}:\n{said}"
    return said


def bare(line: str) -> str:
    """A line without its numbers, and with single blanks."""
    return " ".join(NUMBER.sub("#", line).replace("─", "").split())


def check_printed(shown: str, printed: str) -> None:
    """Fail where a line that is shown was not printed, but for its numbers."""
    there = {bare(line) for line in printed.splitlines()}
    missing = [line for line in shown.splitlines() if line.strip(" .") and bare(line) not in there]
    assert not missing, f"not printed: {missing}\nprinted:\n{printed}"
