"""The text of ``result.json``: strict JSON, and reading it back."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.report.upgrade import READABLE, upgraded
from mvreg.report.upgrade import SCHEMA as SCHEMA


def dumps(report: Mapping[str, object]) -> str:
    """The report as strict JSON: no NaN, no Infinity."""
    return json.dumps(to_plain(report), indent=1, allow_nan=False) + "\n"


def load_report(path: Path) -> dict[str, Any]:
    """Read a ``result.json``, or the one in a run folder, in the words of the present schema.

    Reports of earlier schemas are brought up to it, see `mvreg.report.upgrade`.

    Raises
    ------
    InputError
        If there is none, or it is of a schema that cannot be read.
    """
    file = path / "result.json" if path.is_dir() else path
    try:
        report = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"cannot read {file}: {error.strerror or error}; expected a run folder with a "
            "result.json, as `mvreg` leaves it at the end of a run"
        ) from None
    except ValueError as error:
        raise InputError(f"{file} is not JSON ({error}); was the file cut short?") from None
    schema = report.get("schema") if isinstance(report, dict) else None
    if schema not in READABLE:
        known = " or ".join(map(str, READABLE))
        raise InputError(f"{file}: expected a report with schema {known}, found {schema!r}")
    return upgraded(report)


def to_plain(value: Any) -> Any:
    """Turn a value into what strict JSON can say: NaN and infinity become None."""
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, np.ndarray | np.generic):
        return to_plain(value.tolist())
    if isinstance(value, list | tuple):
        return [to_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, str | int):
        return value
    return str(value)
