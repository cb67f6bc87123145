"""Data sets that build on others: load one by its name on the command line."""

from __future__ import annotations

import re

import numpy as np

from mvreg.errors import InputError
from mvreg.types import ScanSet

#: Blanks in brackets or quotation marks do not end a word.
WORD = re.compile(r"""(?:\[[^\]]*\]|'[^']*'|"[^"]*"|\S)+""")


def load_named(key: str, words: str, rng: np.random.Generator) -> ScanSet:
    """Load a data set by its name, which parameters of its own may follow.

    Parameters
    ----------
    key : str
        The parameter that names it, for messages.
    words : str
        ``bunny``, or ``tiny shape=blob-0 views=3``: what stands behind ``dataset=`` and
        ``dataset.`` on the command line.
    rng : numpy.random.Generator
        For what it draws at random.

    Raises
    ------
    InputError
        If there is no such data set or parameter, or its scans cannot be found.
    """
    from mvreg.config.compose import compose, stage_from

    name, *parameters = WORD.findall(words) or [""]
    if not name or "=" in name:
        raise InputError(
            f"{key}: expected the name of a data set, which parameters may follow, as in "
            f"'tiny views=3'; got {words!r}"
        )
    try:
        config = compose([f"dataset={name}", *(f"dataset.{each}" for each in parameters)])
        found: ScanSet = stage_from(config, "dataset")(rng)
    except InputError as error:
        raise InputError(f"{key}={words!r}: {error}") from error
    return found
