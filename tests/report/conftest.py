"""Pages of runs, and a browser to open them in, shared by the tests."""

from __future__ import annotations

import browsing
import pytest

import mvreg
from mvreg.report.build import build_report
from mvreg.report.page.render import write_page


def write(folder, scans):
    result = mvreg.register(scans)
    report = build_report(
        scans, result.views, result, method="auto", rng=0, seconds={"total": 1.0}, config={}
    )
    return write_page(folder, report, scans, result.views), report


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    driver = browsing.start(tmp_path_factory.mktemp("profile"))
    yield driver
    driver.quit()


@pytest.fixture(scope="session")
def figurine(tmp_path_factory):
    return write(tmp_path_factory.mktemp("figurine"), mvreg.dataset("figurine"))


@pytest.fixture(scope="session")
def parted(tmp_path_factory):
    """Two objects, and a scan of a third, which is not placed."""
    scans = mvreg.dataset(
        "mixture", of=["tiny views=4", "tiny views=3 shape=blob-0", "tiny views=1 shape=blob-2"]
    )
    return write(tmp_path_factory.mktemp("mixed"), scans)


@pytest.fixture(scope="session")
def written():
    """Registers scans and writes their page into a folder: the file, and the report."""
    return write


@pytest.fixture
def page(browser, figurine):
    browsing.resize(browser, 1300)
    browsing.visit(browser, figurine[0])
    yield browser
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
