import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def data_root() -> Path:
    """The real scans; without them the test is skipped, and says so."""
    root = os.environ.get("MVREG_DATA")
    if not root or not Path(root).is_dir():
        pytest.skip("needs real scans: set MVREG_DATA to the folder that holds them")
    return Path(root)
