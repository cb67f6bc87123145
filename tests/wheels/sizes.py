"""Say how large mvreg is when installed, and what each extra adds; for the table in INSTALL.md.

    python tests/wheels/sizes.py

Sums the files of the distributions that this environment has, compiled Python included,
and says which are missing. Two extras that share a distribution count it each.
"""

from __future__ import annotations

from importlib import metadata

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name


def needed(name: str, extra: str, found: set[str]) -> set[str]:
    """Add `name` and all that it needs, with an extra, to `found`; what is missing, too."""
    name = canonicalize_name(name)
    if name in found and not extra:
        return found
    found.add(name)
    try:
        lines = metadata.requires(name) or []
    except metadata.PackageNotFoundError:
        return found
    for need in map(Requirement, lines):
        if need.marker is None or need.marker.evaluate({"extra": extra}):
            for inner in need.extras or {""}:
                needed(need.name, inner, found)
    return found


def size(name: str) -> int | None:
    """Bytes of a distribution's files; None where it is not installed."""
    try:
        files = metadata.files(name) or []
    except metadata.PackageNotFoundError:
        return None
    return sum(path.stat().st_size for path in (f.locate() for f in files) if path.is_file())


def told(names: set[str]) -> str:
    """Sum and missing ones."""
    sizes = {name: size(name) for name in sorted(names)}
    absent = [name for name, found in sizes.items() if found is None]
    total = sum(found for found in sizes.values() if found is not None)
    largest = sorted(sizes, key=lambda name: -(sizes[name] or 0))[:3]
    return f"{total / 1e6:.0f} MB, {len(names)} distributions, largest {', '.join(largest)}" + (
        f"; not installed: {', '.join(absent)}" if absent else ""
    )


if __name__ == "__main__":
    base = needed("mvreg", "", set())
    print("mvreg:", told(base))
    for extra in metadata.metadata("mvreg").get_all("Provides-Extra") or []:
        print(f"mvreg[{extra}] adds:", told(needed("mvreg", extra, set()) - base))
