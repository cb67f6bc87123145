"""No kernel reads outside its arrays, whatever it is given: an answer or a clean exception.

A crash ends the whole test run, so that it cannot go unseen.
"""

import importlib
import inspect
import pkgutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_calls import HUGE, K, cases, made, spoilt

from mvreg import kernels
from mvreg.kernels import fit, propagate, ransac, trimmed_pairs
from mvreg.kernels.tree import Tree

CLEAN = (ValueError, TypeError, IndexError, OverflowError)
COMPILED = sorted(
    module.name
    for module in pkgutil.iter_modules(kernels.__path__)
    if module.name not in ("checks", "reference", "results")
)


def public(name):
    """The names of a compiled kernel's functions and classes, and of the latter's methods."""
    module = importlib.import_module(f"mvreg.kernels.{name}")
    found = set()
    for key, value in vars(module).items():
        own = getattr(value, "__module__", None) == module.__name__
        if key.startswith("__") or not own:
            continue
        if inspect.isclass(value):
            found.add(f"{name}.{key}")
            found |= {
                f"{name}.{key}.{method}"
                for method, what in vars(value).items()
                if not method.startswith("__") and callable(what)
            }
        elif callable(value):
            found.add(f"{name}.{key}")
    return found


NAMES = sorted(cases())
ASKED = [name for name in NAMES if cases()[name][1]]


def copied(right):
    """Arguments that a call may write into."""
    return [a.copy() if isinstance(a, np.ndarray) and a.flags.writeable else a for a in right]


def call(function, these):
    """An answer or a clean exception; NumPy's warnings of what it converts are answers."""
    with np.errstate(all="ignore"):
        try:
            function(*these)
        except (*CLEAN, RuntimeWarning, np.exceptions.ComplexWarning):
            pass


def test_every_public_entry_has_its_case():
    assert set().union(*map(public, COMPILED)) == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_right_has_an_answer(name):
    function, right = cases()[name]
    function(*copied(right))


@pytest.mark.parametrize("name", NAMES)
def test_one_wrong_argument(name):
    function, right = cases()[name]
    for place, value in enumerate(right):
        for wrong in spoilt(value):
            these = copied(right)
            these[place] = wrong
            call(function, these)


@settings(max_examples=600, deadline=None)
@given(st.sampled_from(ASKED), st.data())
def test_several_wrong_arguments(name, data):
    function, right = cases()[name]
    these = copied(right)
    for place in data.draw(st.sets(st.integers(0, len(right) - 1), min_size=1, max_size=4)):
        these[place] = data.draw(st.sampled_from(list(spoilt(right[place]))))
    call(function, these)


@pytest.mark.parametrize(
    "name",
    [name for name in NAMES if any(isinstance(a, np.ndarray) for a in cases()[name][1])],
)
def test_arrays_that_are_only_read_may_be_read_only_and_apart(name):
    function, right = cases()[name]
    written = 4 if name == "residuals.rows" else 0
    these = copied(right)
    for place, value in enumerate(these[: len(these) - written]):
        if isinstance(value, np.ndarray):
            these[place] = np.repeat(value, 2, axis=0)[::2]
            these[place].flags.writeable = False
    function(*these)


@pytest.mark.parametrize("seeds", [[[0, K]], [[K, 0]], [[-1, 0]], [[0, -1]], [[HUGE, HUGE]]])
def test_seeds_outside_the_keypoints_are_refused(seeds):
    shape = made()["shape"]
    with pytest.raises(ValueError, match=rf"seeds.*: expected positions among {K}, got"):
        propagate.spread(shape, shape, seeds, True, 0.5, 0.2, 9.0, 1)


def test_draws_outside_their_set_are_refused():
    m = made()
    for wrong in (6, -1):
        draws = m["draws"].copy()
        draws[1, 2, 0] = wrong
        with pytest.raises(ValueError, match=f"among the 6 matches of set 1, got {wrong}"):
            ransac.consensus(m["points"], m["points"], m["pairs"], np.array([0, 6, 12]), draws, 0.5)


def test_searches_end_where_squares_overflow():
    far = np.array([[1e200, 0, 0], [-1e200, 0, 0]])
    found = fit.fit(Tree(far), far, np.stack([np.eye(3)] * 2), 2, 1e-3)
    assert (found.counts <= 1).all()
    with pytest.raises(ValueError, match="so far apart that these overflow"):
        trimmed_pairs.trimmed(Tree(far[:1]), far[1:], 1.0, 0.4, 3.0)
