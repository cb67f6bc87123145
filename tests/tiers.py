"""Which tests belong to which tier: the one place that decides it.

``check`` is a part of ``test``, and ``test`` of ``all``. The first prefix that fits a test's file
says its tier, and a test marked ``slow`` belongs to ``all`` whatever its file. A file that nothing
names belongs to ``test``, so that a new one is run until somebody decides otherwise.
"""

TIERS = ("check", "test", "all")

#: The start of a file's path in the repository, and the tier of its tests.
TIER_OF = (
    ("tests/documents/test_docs.py", "all"),  # runs what the documents say
    ("tests/documents/test_pages.py", "all"),  # so do these three
    ("tests/documents/test_notebooks.py", "all"),
    ("tests/documents/test_tutorials.py", "all"),
    ("tests/documents/test_site.py", "test"),  # Sphinx takes a quarter of a minute
    ("tests/documents/", "check"),
    ("plugins/mvreg-peers/", "all"),
    ("tests/examples/", "all"),  # whole programs
    ("tests/config/test_levels.py", "test"),  # whole runs, as are the next four
    ("tests/stages/strategy/test_best_first.py", "test"),
    ("tests/stages/strategy/test_joint_verdict.py", "test"),
    ("tests/test_tiers.py", "test"),
    ("tests/types/test_features.py", "test"),
    ("tests/config/", "check"),
    ("tests/evaluation/", "check"),
    ("tests/evidence/", "check"),
    ("tests/geometry/", "check"),
    ("tests/io/", "check"),
    ("tests/kernels/test_stubs.py", "test"),  # mypy once more
    ("tests/kernels/", "check"),
    ("tests/report/test_page_browser.py", "test"),  # a browser takes a minute
    ("tests/report/", "check"),
    ("tests/stages/", "check"),
    ("tests/surface/", "check"),
    ("tests/types/", "check"),
    ("tests/wheels/", "check"),
)
DEFAULT = "test"


def tier_of(path: str, slow: bool = False) -> str:
    """Return the tier of a test in the file `path`, which is relative to the repository."""
    if slow:
        return "all"
    return next((tier for start, tier in TIER_OF if path.startswith(start)), DEFAULT)


def runs(tier: str, asked: str) -> bool:
    """Whether a test of `tier` runs when the tier `asked` is."""
    return TIERS.index(tier) <= TIERS.index(asked)
