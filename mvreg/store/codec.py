"""Records as plain arrays and a description in JSON, and back.

Nothing is executed to read an entry: it names a few classes that are known here, and every record
checks itself when it is made again. Numbers come back to the last bit.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from mvreg import types
from mvreg.store.content import plain_class
from mvreg.types import Array

#: The classes that any entry may be made of.
RECORDS = {
    cls.__name__: cls for cls in vars(types).values() if isinstance(cls, type) and is_dataclass(cls)
}
Arrays = dict[str, np.ndarray[Any, Any]]


class EntryError(ValueError):
    """An entry that is damaged, or not what it should be."""


def encoded(value: Any) -> tuple[str, Arrays]:
    """A record, or what records are made of, as a description (JSON) and the arrays in it.

    Whole numbers are kept in the smallest type that holds them. A field whose metadata say
    ``{"stored": False}`` is left out, and has its default when it comes back.
    """
    arrays: Arrays = {}
    return json.dumps(_described(value, arrays)), arrays


def decoded(description: str, arrays: Mapping[str, Any], *more: type) -> Any:
    """What `encoded` has encoded; `more` are classes besides those of `mvreg.types`.

    Raises
    ------
    EntryError
        If it cannot be.
    """
    known = {**RECORDS, **{cls.__name__: cls for cls in more}}
    try:
        return _made(json.loads(description), arrays, known)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise EntryError(str(error)) from error


def _described(value: Any, arrays: Arrays) -> Any:
    """A value for JSON: arrays by their names, records and sequences by a tag."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray):
        name = str(len(arrays))
        arrays[name] = np.ascontiguousarray(_smallest(value))
        return {"array": name, "dtype": value.dtype.str}
    if isinstance(value, tuple | list):
        return {type(value).__name__: [_described(one, arrays) for one in value]}
    if isinstance(value, Mapping):
        return {"mapping": [[key, _described(one, arrays)] for key, one in value.items()]}
    if is_dataclass(value) and not isinstance(value, type):
        own = {
            field.name: _described(getattr(value, field.name), arrays)
            for field in fields(value)
            if field.metadata.get("stored", True)
        }
        return {"record": plain_class(value).__name__, "fields": own}
    raise TypeError(f"expected records of arrays, numbers and texts, got {type(value).__name__}")


def _made(said: Any, arrays: Mapping[str, Any], known: Mapping[str, type]) -> Any:
    """The value that a description says."""
    if not isinstance(said, dict):
        return said
    if "array" in said:
        return np.asarray(arrays[said["array"]]).astype(np.dtype(said["dtype"]), copy=False)
    if "tuple" in said:
        return tuple(_made(one, arrays, known) for one in said["tuple"])
    if "list" in said:
        return [_made(one, arrays, known) for one in said["list"]]
    if "mapping" in said:
        return {key: _made(one, arrays, known) for key, one in said["mapping"]}
    own = {name: _made(one, arrays, known) for name, one in said["fields"].items()}
    return known[said["record"]](**own)


def _smallest(values: Array) -> np.ndarray[Any, Any]:
    """Whole numbers in the smallest type that holds them all."""
    if values.dtype.kind not in "iu" or not values.size:
        return values
    low, high = int(values.min()), int(values.max())
    return values.astype(np.promote_types(np.min_scalar_type(low), np.min_scalar_type(high)))
