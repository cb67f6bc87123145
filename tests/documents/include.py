"""Code in the documents is included from the files that run: ``make include`` puts it there.

Below a line ``<!-- include: FILE -->`` a document holds the file, whole, as a block of code; FILE
is relative to the document. `test_docs.py` fails where the two differ.
"""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PATTERNS = ("*.md", "docs/**/*.md", "plugins/*.md", "plugins/*/*.md", "experiments/*.md")
DOCUMENTS = sorted(file for pattern in PATTERNS for file in ROOT.glob(pattern))
INCLUDE = re.compile(
    r"^(<!-- include: (\S+) -->\n)(?:```\w*\n.*?^```\n)?", re.DOTALL | re.MULTILINE
)
LANGUAGES = {".py": "python", ".toml": "toml", ".yaml": "yaml", ".sh": "sh"}


def included(document: Path) -> str:
    """The text of a document with every included file as it is now."""

    def block(match: re.Match[str]) -> str:
        file = document.parent / match[2]
        return f"{match[1]}```{LANGUAGES[file.suffix]}\n{file.read_text().rstrip()}\n```\n"

    return INCLUDE.sub(block, document.read_text())


if __name__ == "__main__":
    for document in DOCUMENTS:
        document.write_text(included(document))
