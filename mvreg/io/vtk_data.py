"""The data of points or cells in a legacy VTK file: scalars, colours, normals, fields."""

from __future__ import annotations

from urllib.parse import unquote

import numpy as np

from mvreg.errors import InputError
from mvreg.io.vtk_arrays import NamedArray
from mvreg.io.vtk_words import Words

#: The sections that begin them.
DATA = ("POINT_DATA", "CELL_DATA")
#: Kinds of arrays whose heading is ``KIND NAME TYPE``: components, and role as of a `NamedArray`.
_PLAIN = {
    "VECTORS": (3, ""), "NORMALS": (3, "normals"), "TENSORS": (9, ""), "TENSORS6": (6, ""),
    "GLOBAL_IDS": (1, ""), "PEDIGREE_IDS": (1, ""), "EDGE_FLAGS": (1, ""),
}  # fmt: skip
#: What may begin an array besides.
_OTHERS = ("SCALARS", "COLOR_SCALARS", "LOOKUP_TABLE", "TEXTURE_COORDINATES", "FIELD", "METADATA")


def read_data(words: Words, count: int) -> tuple[list[NamedArray], list[str]]:
    """The arrays of `count` points or cells up to the next section, and names of those left out.

    Raises
    ------
    InputError
        With file, line or byte, and reason.
    """
    arrays: list[NamedArray] = []
    left_out: list[str] = []
    while (section := words.section()) and section[0].upper() in (*_PLAIN, *_OTHERS):
        kind = section[0].upper()
        if kind == "METADATA":
            words.skip_metadata()
        elif kind == "LOOKUP_TABLE":
            _skip_table(words, section)
        elif kind == "FIELD":
            arrays += read_fields(words, section)
        else:
            arrays.append(_array(words, section, kind, count))
    kept = [each for each in arrays if len(each.values) == count and each.values.size]
    left_out += [each.name for each in arrays if each not in kept]
    return kept, left_out


def read_fields(words: Words, section: list[str]) -> list[NamedArray]:
    """The arrays of a FIELD, each of as many rows as it has; of strings none.

    Raises
    ------
    InputError
        With file, line or byte, and reason.
    """
    if len(section) < 3 or not _is_count(section[2]):
        raise words.error("'FIELD NAME COUNT'")
    words.next()
    arrays: list[NamedArray] = []
    while len(arrays) < int(section[2]):
        line = words.section()
        if line[:1] == ["METADATA"]:
            words.skip_metadata()
            continue
        if line[:1] == ["NULL_ARRAY"]:
            words.next()
            arrays.append(NamedArray("NULL_ARRAY", np.empty((0, 1))))
            continue
        if len(line) != 4 or not (_is_count(line[1]) and _is_count(line[2])):
            raise words.error("'NAME COMPONENTS COUNT TYPE' of an array of the FIELD")
        words.next()
        arrays.append(_values(words, line[0], line[3], int(line[1]), int(line[2]), ""))
    return arrays


def _array(words: Words, section: list[str], kind: str, count: int) -> NamedArray:
    """One array that is no FIELD, with what stands in its heading."""
    if len(section) < 3:
        raise words.error(f"'{kind} NAME ...'")
    name = section[1]
    if kind == "COLOR_SCALARS":
        components = _small(words, section[2])
        words.next()
        # Bytes in binary files, from 0 to 1 in text.
        binary = "unsigned_char" if words.binary else "float"
        return _values(words, name, binary, components, count, "colours")
    if kind == "SCALARS":
        components = _small(words, section[3]) if len(section) > 3 else 1
        words.next()
        if words.data.startswith(b"LOOKUP_TABLE", words.at):  # what some writers leave out
            words.next()
        return _values(words, name, section[2], components, count, "scalars")
    if kind == "TEXTURE_COORDINATES":
        if len(section) < 4:
            raise words.error("'TEXTURE_COORDINATES NAME COMPONENTS TYPE'")
        components = _small(words, section[2])
        words.next()
        return _values(words, name, section[3], components, count, "")
    components, role = _PLAIN[kind]
    words.next()
    return _values(words, name, section[2], components, count, role)


def _values(
    words: Words, name: str, kind: str, components: int, count: int, role: str
) -> NamedArray:
    name = unquote(name)
    values = words.numbers(components * count, kind, f"{name!r}")
    if len(values) < components * count:  # strings
        return NamedArray(name, np.empty((0, 1)))
    return NamedArray(name, values.reshape(count, components), role)


def _skip_table(words: Words, section: list[str]) -> None:
    """A table of colours, four each: of no use to points."""
    if len(section) < 3 or not _is_count(section[2]):
        raise words.error("'LOOKUP_TABLE NAME SIZE'")
    words.next()
    kind = "unsigned_char" if words.binary else "float"
    words.numbers(4 * int(section[2]), kind, "a table of colours")


def _small(words: Words, word: str) -> int:
    """A number of components."""
    if not (_is_count(word) and 1 <= int(word) <= 64):
        raise InputError(
            f"{words.path}, line {words.number}: expected 1 to 64 components, got {word[:20]!r}"
        )
    return int(word)


def _is_count(word: str) -> bool:
    return word.isascii() and word.isdecimal() and len(word) < 16
