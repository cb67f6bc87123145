"""Records as arrays and JSON, and back."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from mvreg.run import load_method
from mvreg.store.codec import EntryError, decoded, encoded
from mvreg.store.content import digest
from mvreg.testing import blob_views
from mvreg.types import Features, Matches, Pair, Verdict


@dataclass(frozen=True)
class Unknown:
    size: int


def back(value, *more):
    return decoded(*encoded(value), *more)


def test_a_record_comes_back_to_the_last_bit():
    first, second = blob_views()[:2]
    pipeline = load_method("auto").pipeline
    found = pipeline.refine(first, second, np.eye(4))
    for value in (first.features, found, replace(first, scan=None)):
        assert digest(back(value)) == digest(value)
    again = back(found)
    assert again.pairs.dtype == found.pairs.dtype
    assert type(again.converged) is bool


def test_numbers_that_json_does_not_know_come_back():
    pair = Pair("a", "b", Verdict(False, float("inf"), 0.1 + 0.2, "none"), seconds={"seed": 1e-300})
    assert digest(back(pair)) == digest(pair)


def test_sequences_mappings_and_nothing_come_back():
    value = (
        1,
        [2.5, None],
        {"a": np.array([1, 2]), "b": ("x", True)},
        np.float64(3),
        Matches.none(),
    )
    assert digest(back(value)) == digest(value)
    assert isinstance(back(value)[1], list)


@pytest.mark.parametrize("values", [[], [0], [-1, 70000], [2**62, 0], [255, 256]])
def test_whole_numbers_keep_their_type(values):
    array = np.array(values, dtype=np.int64)
    description, arrays = encoded(array)
    np.testing.assert_array_equal(decoded(description, arrays), array)
    assert decoded(description, arrays).dtype == np.int64
    if len(values) and min(values) >= 0 and max(values) < 2**31:
        assert arrays["0"].nbytes < array.nbytes


def test_a_class_that_is_not_known_is_refused():
    description, arrays = encoded(Unknown(1))
    with pytest.raises(EntryError):
        decoded(description, arrays)
    assert decoded(description, arrays, Unknown) == Unknown(1)


NONSENSE = [
    "", "{", '{"record": "Features", "fields": {}}', '{"array": "9", "dtype": "<f8"}',
    '{"record": "Matches", "fields": {"indices": 1, "distances": 2}}',
]  # fmt: skip


@pytest.mark.parametrize("description", NONSENSE)
def test_a_description_that_makes_no_sense_is_refused(description):
    with pytest.raises(EntryError):
        decoded(description, {})


def test_records_check_themselves_when_they_come_back():
    features = blob_views()[0].features
    description, arrays = encoded(features)
    wrong = {**arrays, "1": 2 * arrays["1"]}  # normals of length two
    with pytest.raises(EntryError, match="unit"):
        decoded(description, wrong)
    assert isinstance(decoded(description, arrays), Features)
