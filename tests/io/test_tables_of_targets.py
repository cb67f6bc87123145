"""Tables of targets, as surveyors have them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mvreg.errors import InputError
from mvreg.io.targets import read_targets

WITH_SCANS = {
    "commas": "name,scan,x,y,z\nT1,a b.ply,1.5,-2,3\nT2,c.ply,4,5,6\n",
    "blanks after commas": "Name, Scan, X[m], Y[m], Z[m]\nT1, a b.ply, 1.5, -2, 3\n"
    "T2, c.ply, 4, 5, 6\n",
    "semicolons and decimal commas": "Target;Station;X;Y;Z\nT1;a b.ply;1,5;-2;3\n"
    "T2;c.ply;4;5;6,0\n",
    "tabs, no heading": "# tachymeter\n\nT1\ta b.ply\t1.5\t-2\t3\r\nT2\tc.ply\t4\t5\t6\r\n",
    "other order": 'x,y,z,"scan",Point ID\n1.5,-2,3,"a b.ply",T1\n4,5,6,c.ply,T2\n',
}
PLAIN = {
    "blanks": "T1 1.5 -2 3\nT2 4 5 6\n",
    "blanks and decimal commas": "T1 1,5 -2,0 3,0\nT2 4,0 5,0 6,0\n",
    "map": "\ufeffNr;Easting;Northing;Height\nT1;1,5;-2;3\nT2;4;5;6\n",
    "code between": "id,code,e,n,h\nT1,BM,1.5,-2,3\nT2,BM,4,5,6\n",
}


@pytest.mark.parametrize("kind", [*WITH_SCANS, *PLAIN])
def test_that_tables_are_read_as_they_come(tmp_path, kind):
    path = tmp_path / "a.txt"
    path.write_text({**WITH_SCANS, **PLAIN}[kind], encoding="utf-8")
    first, second = read_targets(path)
    assert (first.name, second.name) == ("T1", "T2")
    assert (first.scan, second.scan) == (("a b.ply", "c.ply") if kind in WITH_SCANS else ("", ""))
    np.testing.assert_array_equal(first.position, [1.5, -2, 3])
    np.testing.assert_array_equal(second.position, [4, 5, 6])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a.txt: expected targets, a name and x, y, z in each line; found none"),
        ("name,x,y\nT1,1,2\n", "expected columns name, x, y and z.*found name, x, y"),
        ("what,x,y,z\nT1,1,2,3\n", "expected columns name, x, y and z"),
        ("T1 1 2 3\nT2 4 5\n", "line 2: expected a name and three numbers, got 'T2 4 5'"),
        ("T1 1 2 3\nT2 4 nan 5\n", "line 2: expected a name and three numbers"),
        ("T1 1 2 3\nT2 4 1_0 5\n", "line 2: expected a name and three numbers"),
        ("T1 1 2 3\n\nT1 4 5 6\n", "line 3: target 'T1' is in line 1, too"),
        ("T1 a 1 2 3\nT1 b 4 5 6\nT1 a 7 8 9", "line 3: target 'T1' is in line 1, too"),
    ],
)
def test_that_what_is_no_table_of_targets_is_told(tmp_path, text, said):
    path = tmp_path / "a.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_targets(path)


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.binary(max_size=80)
    | st.text('Tx1 ,;\t\n"\r\0.-e#', max_size=60).map(str.encode)
    | st.just(b"T,1,2," + b"3" * 200_000)
)
def test_that_garbage_is_refused(tmp_path, content):
    path = tmp_path / "a.txt"
    path.write_bytes(content)
    try:
        found = read_targets(path)
    except InputError as error:
        assert str(path) in str(error)
    else:
        assert all(each.name and np.isfinite(each.position).all() for each in found)


def test_that_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(InputError, match=r"none.csv: cannot be read: No such file"):
        read_targets(tmp_path / "none.csv")
    (tmp_path / "a.csv").write_bytes(b"\xff\xfe\xfa")
    with pytest.raises(InputError, match=r"a.csv: expected text in UTF-8"):
        read_targets(tmp_path / "a.csv")
