"""What methods find on the smallest set is what they found before, up to rounding.

The files in ``golden/`` hold it. Where a change is meant: ``pytest --renew-golden``, and look at
what ``git diff`` says.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from mvreg.library import dataset, register

GOLDEN = Path(__file__).parent / "golden"
METHODS = ("auto", "fcpma", "ocpma", "ocpra", "surfc", "spant")


def answer(method):
    """Poses to the nearest 1e-6, in the order found, what was tried, and what was left over."""
    result = register(dataset("tiny"), method)
    return {
        "reference": result.reference,
        "unregistered": list(result.unregistered),
        "components": len(result.components),
        "pairs": [[p.source, p.target, p.verdict.reliable] for p in result.pairs],
        "poses": {name: np.round(T, 6).tolist() for name, T in result.poses.items()},
    }


@pytest.mark.parametrize("method", METHODS)
def test_the_answer_is_the_golden_one(method, request):
    file, found = GOLDEN / f"{method}.json", answer(method)
    if request.config.getoption("--renew-golden"):
        file.write_text(json.dumps(found, indent=1) + "\n")
        pytest.skip(f"renewed {file.name}")
    assert file.is_file(), "no golden file: run pytest --renew-golden once"
    golden = json.loads(file.read_text())
    poses, others = golden.pop("poses"), found.pop("poses")
    assert found == golden
    assert list(others) == list(poses)
    for name, pose in poses.items():
        np.testing.assert_allclose(others[name], pose, atol=2e-6, err_msg=name)
