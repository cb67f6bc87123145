"""Settings of Sphinx for the site; `build.py` beside it calls Sphinx."""

import sys
from importlib import metadata
from pathlib import Path
from typing import Any

from sphinx.util.inspect import TypeAliasForwardRef

sys.path.insert(0, str(Path(__file__).parent))

project = "mvreg"
author = copyright = "the authors of mvreg"
version = release = metadata.version("mvreg")
html_title = f"mvreg {version}"
language = "en"

extensions = [
    "myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton", "mathml",
]  # fmt: skip
root_doc = "index"
#: Links to headings, as forges make them.
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
myst_links_external_new_tab = False
suppress_warnings: list[str] = []

nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True}
autodoc_type_aliases = {name: name for name in ("Array", "Flags", "Indices")}
napoleon_google_docstring = False
#: Single backticks in docstrings: a link where there is something of that name.
default_role = "py:obj"
python_use_unqualified_type_names = True
maximum_signature_line_length = 80
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_show_search_summary = False  # a browser does not fetch pages from the disk
html_static_path = [str(Path(__file__).parent / "static")]
html_css_files = ["site.css"]
html_permalinks_icon = "#"
copybutton_exclude = ".linenos, .gp"

# Else the name of a type of arrays is shown as ``TypeAliasForwardRef('Array')`` within other types.
TypeAliasForwardRef.__repr__ = lambda self: self.name  # type: ignore[method-assign]


def signature_of(
    app: Any, what: str, name: str, value: Any, options: Any, signature: str | None, returned: Any
) -> tuple[str, Any] | None:
    """Signatures as Python reads them: a protocol is not made, and a default has a value."""
    if what == "class" and getattr(value, "_is_protocol", False):
        return "", None
    if signature and "<factory>" in signature:  # a dataclass's field(default_factory=...)
        return signature.replace("<factory>", "..."), returned
    return None


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("autodoc-process-signature", signature_of)
