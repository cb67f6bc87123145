"""Values on the command line that Hydra's grammar would refuse, such as names of folders."""

from __future__ import annotations

import re
from collections.abc import Sequence

#: Keys whose values are text as it stands: names of files and folders.
TEXT = re.compile(
    r"\+{0,2}(dataset\.(path|path_in|root|ground_truth|initial|pattern|unit)|hydra\.run\.dir"
    r"|hydra\.sweep\.(dir|subdir))"
)
SWEEPS = frozenset(["-m", "--multirun"])


def quoted_paths(words: Sequence[str]) -> list[str]:
    """The same words, values that name files or folders quoted where Hydra would not read them.

    ``dataset.path=scans (1)`` becomes ``dataset.path='scans (1)'``. In a sweep, commas part values,
    as everywhere in a sweep.
    """
    sweep = bool(SWEEPS & set(words))
    return [_quoted(word, sweep) for word in words]


def _quoted(word: str, sweep: bool) -> str:
    key, equals, value = word.partition("=")
    if not equals or not value or not TEXT.fullmatch(key) or _is_read(word, sweep):
        return word
    from mvreg.config.overrides import spelled

    return f"{key}={spelled(value)}"


def _is_read(word: str, sweep: bool) -> bool:
    """Whether Hydra reads a word as the text that it is, or as several for a sweep."""
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import HydraException

    try:
        found = OverridesParser.create().parse_override(word)
        value = found.value()
    except HydraException:
        return False
    if found.is_sweep_override():
        return sweep
    given = word.partition("=")[2]
    return isinstance(value, str) and given == given.strip()  # Hydra would strip it
