"""What other programs write of the same points, each in all its variants: read right, or refused.

`mvreg/io/README.md` says how many there are of each writer.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from manner_variants import MANNER
from writer_variants import ALL, COLOURS, FACES, INTENSITY, NORMALS, POINTS, RGB, UP, Variant

import mvreg.io
from mvreg.errors import InputError
from mvreg.io import read_cloud


def check(found: mvreg.io.PointCloud, variant: Variant) -> None:
    """The points, in order, and what else the variant has."""
    np.testing.assert_allclose(found.points, POINTS, rtol=0, atol=variant.close)
    have = found.attributes
    if "c" in variant.has:
        bytes_each = have["red"].dtype.itemsize
        colours = np.stack([have[name] for name in RGB], axis=1)
        np.testing.assert_array_equal(
            colours, COLOURS.astype("u2") * (257 if bytes_each > 1 else 1)
        )
    if "n" in variant.has:
        normals = np.stack([have[name] for name in UP], axis=1)
        np.testing.assert_allclose(normals, NORMALS, atol=1e-5)
    if "i" in variant.has:
        np.testing.assert_allclose(have.get("share", have["intensity"]), INTENSITY, atol=1e-6)
    if "m" in variant.has:
        assert found.triangles is not None
        corners = found.points[found.triangles]
        np.testing.assert_allclose(corners, POINTS[FACES], rtol=0, atol=variant.close)


@pytest.mark.parametrize("variant", [*ALL, *MANNER], ids=lambda v: f"{v.writer}, {v.what}")
def test_a_variant_is_read_right_or_refused_by_name(
    variant: Variant, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mvreg.io.points.with_points_on_triangles", lambda cloud: cloud)
    path = tmp_path / f"a.{variant.suffix}"
    variant.write(path)
    if variant.refused:
        with pytest.raises(InputError, match=rf"{re.escape(str(path))}.*({variant.refused})"):
            read_cloud(path)
    else:
        check(read_cloud(path), variant)


def test_the_table_counts_the_variants() -> None:
    text = (Path(mvreg.io.__file__).parent / "README.md").read_text()
    rows = re.findall(r"^\| ([\w' ]+?) [\d.]+ \| (\d+) \|", text, re.MULTILINE)
    assert {name: int(count) for name, count in rows} == Counter(v.writer for v in ALL)
    manner = re.search(r"^(\d+) more files are made in the manner of", text, re.MULTILINE)
    assert manner is not None and int(manner[1]) == len(MANNER)
    assert len(ALL) == len({(v.writer, v.what) for v in ALL})
