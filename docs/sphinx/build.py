"""Build the site into ``site/``: ``make docs``.

    python docs/sphinx/build.py [--out FOLDER] [--no-notebooks]

Documents of the whole repository are gathered in ``build/docs``, their links led to each other's
pages, and pages made from the program are written beside them; Sphinx makes HTML of all. A warning
of Sphinx ends it with an error, and so does a link that leads nowhere.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from contents import with_contents
from layout import ROOT, for_the_site, page_of, sources
from links import broken
from made import pages
from sphinx.cmd.build import main as sphinx_build


def gather(folder: Path) -> None:
    """Put all that Sphinx reads into a folder; a file that is as it was is not touched."""
    texts, wanted = pages(), dict[Path, bytes]()
    for file in sources():
        name = file.relative_to(ROOT).as_posix()
        page = page_of(name)
        assert page is not None
        if file.suffix == ".md":
            texts[page] = for_the_site(file.read_text("utf-8"), name)
        else:
            wanted[folder / page] = file.read_bytes()
    there = {page.rpartition(".")[0] for page in texts}
    there |= {str(f.relative_to(folder).with_suffix("")) for f in wanted if f.suffix == ".ipynb"}
    for page, text in texts.items():
        wanted[folder / page] = with_contents(text, page.removesuffix(".md"), there).encode()
    for old in folder.rglob("*"):
        if old.is_file() and old not in wanted:
            old.unlink()
    for file, content in wanted.items():
        if not file.is_file() or file.read_bytes() != content:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)


def build(work: Path, out: Path, notebooks: bool = True) -> int:
    """Build the site.

    Parameters
    ----------
    work : Path
        Where documents are gathered, and what Sphinx read is kept for the next time.
    out : Path
        Where the site goes.
    notebooks : bool
        Run the notebooks; else they are shown without results.

    Returns
    -------
    int
        0, or 1 where there are warnings, errors or broken links, which are printed.
    """
    source = work / "source"
    gather(source)
    mode = "cache" if notebooks else "off"
    options = [
        "-E", "-W", "--keep-going", "-q", "-b", "html", "-c", str(Path(__file__).parent),
        "-d", str(work / "doctrees"), "-D", f"nb_execution_mode={mode}",
        "-D", f"nb_execution_cache_path={work / 'notebooks'}",
    ]  # fmt: skip
    made = work / "html"  # beside it the notebooks that were run are left
    if code := sphinx_build([*options, str(source), str(made)]):
        return code
    if (out / "objects.inv").is_file():  # an older site; nothing else is removed
        shutil.rmtree(out)
    unneeded = shutil.ignore_patterns(".buildinfo*")
    shutil.copytree(made, out, dirs_exist_ok=True, ignore=unneeded)
    found = broken(out)
    for page, target in found:
        sys.stderr.write(f"{page}: {target} leads nowhere\n")
    return int(bool(found))


def main() -> int:
    """Build from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "site")
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "docs")
    parser.add_argument("--no-notebooks", action="store_true", help="show them without results")
    asked = parser.parse_args()
    code = build(asked.work, asked.out, not asked.no_notebooks)
    if not code:
        sys.stdout.write(f"open in a browser: {asked.out / 'index.html'}\n")
    return code


if __name__ == "__main__":
    sys.exit(main())
