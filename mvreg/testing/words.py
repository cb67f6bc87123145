"""Assertions that say in words what was expected, and what came."""

from __future__ import annotations

from typing import Any

import numpy as np

from mvreg.types.checks import shown

__all__ = ["above", "below", "close", "equal", "expect", "is_a", "same_array"]


def expect(holds: Any, wanted: str, got: Any = None) -> None:
    """Raise AssertionError unless it holds; `wanted` follows "expected", `got` is shown."""
    if not bool(holds):
        came = got if isinstance(got, str) else _short(got)
        raise AssertionError(f"expected {wanted}" + ("" if got is None else f"; got {came}"))


def is_a(what: str, value: Any, *classes: type) -> None:
    """Raise AssertionError for a value of another class."""
    names = " or ".join(cls.__name__ for cls in classes)
    expect(isinstance(value, classes), f"{what}: {names}", shown(value))


def equal(what: str, got: Any, wanted: Any) -> None:
    """Raise AssertionError where two values differ; arrays are not for this."""
    expect(got == wanted, f"{what}: {_short(wanted)}", _short(got))


def same_array(what: str, got: Any, wanted: Any) -> None:
    """Raise AssertionError where two arrays differ in shape, or anywhere in a bit."""
    if np.shape(got) != np.shape(wanted):
        raise AssertionError(f"expected {what}, of shape {np.shape(wanted)}; got {np.shape(got)}")
    off = int(np.count_nonzero(np.asarray(got) != np.asarray(wanted)))
    expect(not off, what, f"other values in {off} of {np.size(got)} places")


def close(what: str, got: Any, wanted: Any, rtol: float = 1e-7, atol: float = 0.0) -> None:
    """Raise AssertionError where values differ by more than rounding; says by how much."""
    if np.shape(got) != np.shape(wanted):
        raise AssertionError(f"expected {what}, of shape {np.shape(wanted)}; got {np.shape(got)}")
    if np.allclose(got, wanted, rtol=rtol, atol=atol):
        return
    gaps = np.abs(np.asarray(got, dtype=float) - np.asarray(wanted, dtype=float))
    if gaps.ndim == 0:
        raise AssertionError(f"expected {what}: {float(wanted):.6g}; got {float(got):.6g}")
    at = np.unravel_index(int(np.nan_to_num(gaps, nan=np.inf).argmax()), gaps.shape)
    place = ", ".join(map(str, map(int, at)))
    raise AssertionError(
        f"expected {what}; got {np.asarray(got)[at]:.6g} instead of {np.asarray(wanted)[at]:.6g} "
        f"at ({place})"
    )


def below(what: str, value: Any, limit: float, unit: str = "") -> None:
    """Raise AssertionError for what is not below a limit."""
    expect(value < limit, f"{what} below {limit:.3g}{unit}", f"{value:.3g}{unit}")


def above(what: str, value: Any, limit: float) -> None:
    """Raise AssertionError for what is not above a limit."""
    expect(value > limit, f"{what} above {limit:.3g}", f"{value:.3g}")


def _short(value: Any) -> str:
    words = value if isinstance(value, str) else repr(value)
    return words if len(words) <= 200 and "\n" not in words else shown(value)
