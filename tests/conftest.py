import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture(scope="session")
def data_root() -> Path:
    """The real scans; without them the test is skipped, and says so."""
    root = os.environ.get("MVREG_DATA")
    if not root or not Path(root).is_dir():
        pytest.skip("needs real scans: set MVREG_DATA to the folder that holds them")
    return Path(root)


@pytest.fixture(scope="session", autouse=True)
def own_store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Finished work is kept where the tests alone see it, also by processes that they start."""
    folder = tmp_path_factory.mktemp("store")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MVREG_STORE", str(folder))
        yield folder


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)
