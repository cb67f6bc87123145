"""A hash of all that a piece of work follows from: arrays, records, stages, versions."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

#: Bytes of a hash: two of 2^64 entries are alike with a probability of 2^-65.
SIZE = 24
#: The hash of a record is kept on it: records do not change.
KEPT = "mvreg.store.content"
#: What compiled code is a part of a package.
SUFFIXES = (".py", ".so", ".pyd")


class UnknownContentError(TypeError):
    """Something that cannot be told by its content: a function, an open file."""


def digest(*parts: Any) -> str:
    """The hash of some parts, in their order; floats and arrays count to the last bit.

    Parameters
    ----------
    *parts
        Numbers, texts, arrays, enums, None; sequences and mappings of them; dataclasses, by their
        class and fields. A field whose metadata say ``{"stored": False}`` does not count.

    Raises
    ------
    UnknownContentError
        For anything else.
    """
    found = blake2b(digest_size=SIZE)
    for part in parts:
        _add(found, part)
    return found.hexdigest()


def _add(found: blake2b, part: Any) -> None:
    """Add a part, in a form that no other part has."""
    if part is None or isinstance(part, bool | int | float | str | np.generic | Path):
        value = part.item() if isinstance(part, np.generic) else part
        text = value.hex() if isinstance(value, float) else str(value)
        found.update(f"{type(value).__name__}:{len(text)}:{text};".encode())
    elif isinstance(part, np.ndarray) and part.dtype.kind in "biuf":
        found.update(f"array:{part.dtype.str}:{part.shape};".encode())
        found.update(np.ascontiguousarray(part).data if part.size else b"")
    elif isinstance(part, Enum):
        found.update(f"enum:{type(part).__qualname__}.{part.name};".encode())
    elif isinstance(part, Mapping):
        found.update(f"mapping:{len(part)};".encode())
        for key, value in part.items():
            _add(found, key)
            _add(found, value)
    elif isinstance(part, tuple | list | frozenset):
        several = sorted(part) if isinstance(part, frozenset) else part
        found.update(f"sequence:{len(part)};".encode())
        for one in several:
            _add(found, one)
    elif is_dataclass(part) and not isinstance(part, type):
        found.update(b"record:" + _of_record(part))
    else:
        raise UnknownContentError(f"expected numbers, texts, arrays or records, got {type(part)}")


def _of_record(record: Any) -> bytes:
    """The hash of a dataclass, kept on it where it has room."""
    kept = getattr(record, "__dict__", {})
    if KEPT not in kept:
        found = blake2b(digest_size=SIZE)
        cls = plain_class(record)
        found.update(f"{cls.__module__}.{cls.__qualname__};".encode())
        for field in fields(record):
            if field.metadata.get("stored", True):
                found.update(f"{field.name}=".encode())
                _add(found, getattr(record, field.name))
        if not kept:
            return found.digest()
        kept[KEPT] = found.digest()
    answer: bytes = kept[KEPT]
    return answer


def plain_class(record: Any) -> type:
    """The class of a stage as it was written: a checked one stands for another."""
    cls: type = type(record)
    return getattr(cls, "_mvreg_plain", cls)


def stage_digest(stage: Any) -> str:
    """The hash of a stage: its class, its parameters, and the code of another distribution."""
    module = plain_class(stage).__module__
    return digest(stage, "" if module.partition(".")[0] == "mvreg" else code(module))


@cache
def versions() -> str:
    """The hash of what computes: mvreg's own code as installed, NumPy, SciPy, and Python."""
    packages = [f"{name} {version(name)}" for name in ("mvreg", "numpy", "scipy")]
    return digest(*packages, sys.version, sys.platform, code("mvreg"))


@cache
def code(module: str) -> str:
    """The hash of the sizes and times of the files that a package or module was loaded from."""
    root = module.partition(".")[0]
    file = getattr(sys.modules.get(root), "__file__", None)
    if file is None:
        return ""
    here = Path(file)
    files = sorted(here.parent.rglob("*")) if here.stem == "__init__" else [here]
    stats = [(path, path.stat()) for path in files if path.suffix in SUFFIXES]
    return digest(*(f"{path} {stat.st_size} {stat.st_mtime_ns}" for path, stat in stats))
