"""The site is built without a warning, and its links lead somewhere."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "docs" / "sphinx"
#: What the site leaves to a reader's own browser, at most (bytes).
LARGEST_PICTURE = 300_000


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, without the results of notebooks, which take a kernel and its time."""
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, str(SOURCES / "build.py"), "--out", str(folder / "out"),
         "--work", str(folder / "work"), "--no-notebooks"],
        capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return folder / "out"


@pytest.fixture
def links(monkeypatch):
    monkeypatch.syspath_prepend(str(SOURCES))
    import links

    return links


def test_every_page_is_there_and_can_be_reached(site, links):
    pages = {file.relative_to(site).as_posix() for file in site.rglob("*.html")}
    assert {"index.html", "start.html", "reference/stages.html", "changelog.html"} <= pages
    reached, todo = set(), [site / "index.html"]
    while todo:
        page = todo.pop()
        for target in links.read(page).targets:
            there = (page.parent / target.partition("#")[0]).resolve()
            if there.suffix == ".html" and there.is_file() and there not in reached:
                reached.add(there)
                todo.append(there)
    unreached = {site / page for page in pages} - reached
    assert not {page.name for page in unreached} - {"search.html"}


def test_stages_and_commands_are_those_of_the_program(site):
    from mvreg.cli.main import COMMANDS
    from mvreg.plugins import manager

    stages = (site / "reference/stages.html").read_text()
    assert all(f"{s.kind}={s.name}" in stages for s in manager.stages().values())
    commands = (site / "reference/command_line.html").read_text()
    assert all(f"mvreg {name}" in commands for name in COMMANDS)


def test_contracts_say_how_a_stage_is_called(site):
    from mvreg.contracts import KINDS

    page = (site / "reference/api/mvreg.contracts.html").read_text()
    text = " ".join(re.sub(r"<[^>]+>", " ", page).split())
    assert page.count('.__call__"') >= len(KINDS)
    assert "Return seed matches, by ascending distance" in text
    assert "( * args" not in text and "*args" not in text
    everything = [file.read_text() for file in site.glob("reference/api/*.html")]
    assert not [text for text in everything if "&lt;factory&gt;" in text]


def test_formulas_need_no_script(site):
    assert "<math" in (site / "method/search.html").read_text()
    script = re.compile(r"<script[^>]*mathjax", re.IGNORECASE)
    assert not [page for page in site.rglob("*.html") if script.search(page.read_text())]


def test_a_broken_link_and_what_is_loaded_from_elsewhere_are_found(links, tmp_path):
    (tmp_path / "a.html").write_text(
        '<p id="x"><a href="a.html#x">1</a><a href="a.html#y">2</a><a href="b.html">3</a>'
        '<a href="https://example.org/">4</a><script src="https://example.org/s.js"></script>'
    )
    found = [target for _, target in links.broken(tmp_path)]
    assert found == ["https://example.org/s.js", "a.html#y", "b.html"]


def test_links_lead_to_pages_or_name_files(monkeypatch):
    monkeypatch.syspath_prepend(str(SOURCES))
    import layout

    text = "[g](../mvreg/GLOSSARY.md#x) [e](../mvreg/evidence) ![r](pictures/report.png)\n"
    code = "```\n[g](../mvreg/GLOSSARY.md)\n```\n"
    shown = layout.for_the_site(text + code, "docs/start.md")
    assert shown == (
        "[g](reference/glossary.md#x) e (`mvreg/evidence`) ![r](pictures/report.png)\n" + code
    )
    section = "[c](../mvreg/API.md#mvregcontracts) [p](../mvreg/API.md#what-is-public)"
    assert layout.for_the_site(section, "docs/start.md") == (
        "[c](reference/api/mvreg.contracts.md) [p](reference/api/index.md#what-is-public)"
    )
    with pytest.raises(FileNotFoundError, match=r"nothing\.md"):
        layout.for_the_site("[a](nothing.md)", "docs/start.md")


def test_pictures_are_small():
    pictures = list((ROOT / "docs").rglob("*.png"))
    assert pictures
    assert [file.name for file in pictures if file.stat().st_size > LARGEST_PICTURE] == []
