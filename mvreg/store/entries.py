"""One entry as a file: arrays in the safetensors format, a description, and a checksum."""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import blake2b
from pathlib import Path
from typing import Any
from uuid import uuid4

from mvreg.store.codec import Arrays, EntryError, decoded, encoded

#: The version of the format; an entry of another is not read.
FORMAT = "mvreg entry 1"
#: What is being written has this suffix until it is whole.
UNFINISHED = ".part"


def write(file: Path, key: str, value: Any) -> int:
    """Write an entry: aside, then moved into place, so that nobody reads half of it.

    Returns
    -------
    int
        Its size in bytes.

    Raises
    ------
    OSError
        If it cannot be written; nothing is left behind.
    """
    from safetensors.numpy import save

    description, arrays = encoded(value)
    said = {"format": FORMAT, "key": key, "description": description}
    content = save(arrays, {**said, "checksum": checksum(said, arrays)})
    file.parent.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_name(f"{file.stem}-{uuid4().hex}{UNFINISHED}")
    try:
        unfinished.write_bytes(content)
        unfinished.replace(file)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise
    return len(content)


def read(file: Path, key: str, *more: type) -> Any:
    """The value of an entry; `more` are classes besides those of `mvreg.types`.

    Raises
    ------
    OSError
        If there is none.
    EntryError
        If it is damaged, of another format, or was written under another key.
    """
    description, arrays = verified(file, key)
    return decoded(description, arrays, *more)


def verified(file: Path, key: str) -> tuple[str, Arrays]:
    """The description and the arrays of an entry, as they were written; raises as `read`."""
    from safetensors import SafetensorError, safe_open

    if not file.is_file():
        raise FileNotFoundError(file)
    try:
        with safe_open(file, "np") as opened:
            said = dict(opened.metadata() or {})
            arrays = {name: opened.get_tensor(name) for name in opened.keys()}  # noqa: SIM118
    except SafetensorError as error:
        raise EntryError(str(error)) from error
    expected = said.pop("checksum", None)
    if said.get("format") != FORMAT or said.get("key") != key:
        raise EntryError(f"expected {FORMAT!r} of {key}, got {said.get('format')!r}")
    if checksum(said, arrays) != expected:
        raise EntryError("the checksum is wrong")
    return said["description"], arrays


def checksum(said: Mapping[str, str], arrays: Arrays) -> str:
    """Of the description and of every array."""
    found = blake2b(digest_size=16)
    for name in sorted(said):
        found.update(f"{name}={said[name]};".encode())
    for name in sorted(arrays):
        found.update(f"{name}:{arrays[name].dtype.str}:{arrays[name].shape};".encode())
        found.update(arrays[name].data if arrays[name].size else b"")
    return found.hexdigest()
