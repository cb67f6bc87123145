"""Every registered stage in the default method: it places what the default places, or says why."""

import pytest
from stage_matrix import EXCEPTIONS, STAGES, is_complete, registered


@pytest.mark.parametrize("key", STAGES)
def test_a_stage_fits_the_default_method(key: str) -> None:
    """An exception that places all scans after all fails too: it is to be removed."""
    result = registered(key)
    if result is None:
        assert key not in EXCEPTIONS
    else:
        assert is_complete(result) == (key not in EXCEPTIONS)


def test_every_exception_is_a_stage_with_a_reason() -> None:
    assert set(EXCEPTIONS) <= set(STAGES)
    assert all(EXCEPTIONS.values())
