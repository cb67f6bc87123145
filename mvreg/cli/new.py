"""``mvreg new-plugin``: a plugin that works, to be changed into one's own."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path


def new_plugin(arguments: Sequence[str]) -> int:
    """Write the folder of a new plugin: a working stage, presets, tests, a README."""
    parser = argparse.ArgumentParser("mvreg new-plugin", description=new_plugin.__doc__)
    parser.add_argument("name", help="small letters, digits and underscores, such as my_seed")
    parser.add_argument("kind", help="a kind of stage, as mvreg plugins lists them; reader, "
                        "exporter, observer")  # fmt: skip
    parser.add_argument("--to", type=Path, default=Path(), help="where the folder is made")
    asked = parser.parse_args(arguments)
    from mvreg.kit.new import new_plugin as write

    folder, files = write(asked.name, asked.kind, asked.to)
    there = shlex.quote(str(folder))
    lines = [
        f"wrote {folder}:", *(f"  {file}" for file in files if not file.endswith("py.typed")),
        "", "next:", f"  pip install -e {there}", f"  mvreg plugins check {asked.name}",
        f"  pytest {there}",
    ]  # fmt: skip
    sys.stdout.write("\n".join(lines) + "\n")
    return 0
