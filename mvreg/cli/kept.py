"""``mvreg store``: what finished work is kept, and how to be rid of it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path


def store(arguments: Sequence[str]) -> int:
    """Say where finished work is kept, and how much of it; ``clear`` removes it."""
    from mvreg.store.folder import GIGABYTE, FolderStore, default_folder

    parser = argparse.ArgumentParser("mvreg store", description=store.__doc__)
    parser.add_argument("action", nargs="?", choices=["clear"], help="remove all of it")
    parser.add_argument("--folder", type=Path, help="another store than the usual one")
    chosen = parser.parse_args(arguments)
    folder = (chosen.folder or default_folder()).expanduser().absolute()
    opened = FolderStore(folder, GIGABYTE)
    if chosen.action == "clear":
        count, size = opened.clear()
        sys.stdout.write(f"removed {count} entries, {size / GIGABYTE:.3f} GB, from {folder}\n")
        return 0
    sizes = [size for _, size, _ in opened.known()]
    sys.stdout.write(
        f"{folder}: {len(sizes)} entries, {sum(sizes) / GIGABYTE:.3f} GB\n"
        "store=DIR and store_size=GIGABYTES choose another place and bound, store=false none; "
        "mvreg store clear removes all\n"
    )
    return 0
