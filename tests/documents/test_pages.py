"""A reader who does what a page of the documentation says sees what it shows."""

from pathlib import Path

import pytest
from blocks import blocks_of, check_printed, commands_of, follow

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
#: So many blocks may be marked as not to be run: those that need a cluster, or a place to install.
NOT_RUN = 8


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(DOCS).as_posix())
def test_what_a_page_says_can_be_done(page, tmp_path):
    said = [block for block in blocks_of(page.read_text()) if block.language in ("sh", "python")]
    done = follow(page, tmp_path)
    assert done or not [block for block in said if not block.special]


def test_few_blocks_are_not_run_and_each_says_why():
    blocks = [block for page in PAGES for block in blocks_of(page.read_text())]
    reasons = [block.argument for block in blocks if block.special == "not run"]
    assert len(reasons) <= NOT_RUN
    assert all(len(reason) > 5 for reason in reasons)


def test_blocks_are_read_as_they_are_meant():
    (file, one, two) = blocks_of(
        "a\n<!-- file: b.yaml -->\n```yaml\nx: 1\n```\n\n```sh\n# c\nmvreg d  # ends with 3: e\n"
        "mvreg f \\\n  'g#h'\n```\n<!-- not run: Slurm -->\n```sh\nsbatch\n```\n"
    )
    assert (file.special, file.argument, file.text) == ("file", "b.yaml", "x: 1\n")
    assert commands_of(one) == [("mvreg d", 3), ("mvreg f    'g#h'", 0)]
    assert two.special == "not run"


def test_a_line_that_was_not_printed_is_noticed():
    check_printed("placed 3 of 4\n...\n", "so\nplaced  5 of 12\n")
    with pytest.raises(AssertionError, match="not printed"):
        check_printed("placed 3 of 4 scans\n", "placed 3 of 4\n")
