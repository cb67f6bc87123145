"""mvreg's own formats and the contract of formats that plugins bring; and what it finds."""

import re
import sys
from dataclasses import replace

import numpy as np
import pytest

from mvreg.export.poses.matrices import write_matrices
from mvreg.export.table import BY_NAME
from mvreg.testing import ExportContract
from mvreg.testing.placed import placements_of_a_run


def suite(name, **waived):
    return type(f"Test{name.title()}", (ExportContract,), {"format": BY_NAME[name], **waived})


#: Files with an identifier drawn at random in them.
DRAWN = {"e57"}
for _name in sorted({each.name for each in BY_NAME.values()} - {"e57_poses"}):  # needs E57 files
    globals()[f"Test{_name.title()}"] = suite(_name, repeatable=_name not in DRAWN)


def moved_by_a_metre(folder, component, placements):
    other = {name: pose + np.eye(4, k=3) for name, pose in component.poses.items()}
    return write_matrices(folder, replace(component, poses=other), placements)


def grows(folder, component, placements):
    with (folder / "matrices.txt").open("a") as file:
        file.write(repr(component.poses))
    return []


def constant(folder, component, placements):
    (folder / "matrices.txt").write_text("poses")
    return []


def chatty(folder, component, placements):
    sys.stdout.write("written")
    return write_matrices(folder, component, placements)


def changes(folder, component, placements):
    said = write_matrices(folder, component, placements)
    component.poses["more"] = np.eye(4)
    return said


@pytest.mark.parametrize(
    ("write", "test", "said"),
    [
        (moved_by_a_metre, "poses_come_back_as_they_were", "expected T_model_scan of 'a scan.ply'"),
        (grows, "what_was_there_is_replaced", "expected the same contents a second time"),
        (constant, "other_poses_make_other_files", "got the same for other poses"),
        (chatty, "it_says_nothing", "got 'written"),
        (lambda *_: [], "it_writes_what_it_says_and_nothing_elsewhere", "a file as `files` has it"),
        (lambda *_: None, "remarks_are_a_list_of_texts", "a list of remarks"),
    ],
)
def test_the_contract_finds_what_is_wrong(write, test, said):
    suite = ExportContract()
    suite.format = replace(BY_NAME["matrices"], write=write)
    with pytest.raises(AssertionError, match=re.escape(said)):
        getattr(suite, f"test_{test}")()


def test_it_finds_a_format_that_changes_the_poses():
    suite = ExportContract()
    suite.format = replace(BY_NAME["matrices"], write=changes)
    first = placements_of_a_run().components[0]
    suite.components = lambda: [("a copy", replace(first, poses=dict(first.poses)))]
    with pytest.raises(AssertionError, match="expected poses and scans left as they are"):
        suite.test_it_leaves_what_it_is_given_as_it_is()


def test_it_finds_points_that_are_elsewhere():
    suite = ExportContract()
    ply = BY_NAME["ply"]

    def write(folder, model):
        poses = {name: pose + np.eye(4, k=3) for name, pose in model.component.poses.items()}
        return ply.write(folder, replace(model, component=replace(model.component, poses=poses)))

    suite.format = replace(ply, write=write)
    with pytest.raises(AssertionError, match="of where they belong"):
        suite.test_points_come_back_where_they_were()
