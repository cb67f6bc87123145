"""The map of the house lists every room, and the glossary is found from it."""

import re
from pathlib import Path

import mvreg

HOUSE = Path(mvreg.__file__).parent
MAP = (HOUSE / "README.md").read_text(encoding="utf-8")
GLOSSARY = (HOUSE / "GLOSSARY.md").read_text(encoding="utf-8")


def rooms() -> set[str]:
    """Every package of mvreg but the outermost, and those that hold nothing but packages."""
    found = {file.parent.relative_to(HOUSE).as_posix() for file in HOUSE.rglob("__init__.py")}
    return found - {".", "conf"}


def test_every_room_is_on_the_map_and_no_other():
    listed = re.findall(r"^\| `([^`]+)` \|", MAP, re.MULTILINE)
    assert len(listed) == len(set(listed))
    assert set(listed) == rooms()


def test_what_the_documents_link_to_is_there():
    for document in ("README.md", "GLOSSARY.md", "report/SCHEMA.md"):
        file = HOUSE / document
        for target in re.findall(r"\]\(([^)#]+)\)", file.read_text(encoding="utf-8")):
            assert (file.parent / target).exists(), f"{document} links to {target}"


def test_files_named_on_the_map_are_there():
    files = re.findall(r"`([\w/]+\.(?:py|md))`", MAP)
    assert files
    assert [file for file in files if not (HOUSE / file).exists()] == []


def test_the_glossary_defines_each_word_once():
    words = [
        word.strip()
        for row in re.findall(r"^\| ([^|]+) \|", GLOSSARY, re.MULTILINE)[1:]
        for word in row.split(",")
    ]
    assert len(words) == len(set(words)) > 40
    assert len(GLOSSARY.splitlines()) <= 60, "one screen"
