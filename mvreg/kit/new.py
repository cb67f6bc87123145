"""Write a new plugin: a distribution that works, to be changed into one's own."""

from __future__ import annotations

import shutil
import tempfile
from importlib import resources
from pathlib import Path

from mvreg.contracts import KINDS
from mvreg.errors import InputError
from mvreg.kit.naming import Naming, checked_naming
from mvreg.kit.tests_of import tests_of
from mvreg.kit.texts import hooks, preset, pyproject, readme

__all__ = ["new_plugin"]


def new_plugin(name: str, kind: str, where: Path) -> tuple[Path, list[str]]:
    """Write the folder of a new plugin, all of it or nothing.

    Parameters
    ----------
    name : str
        Small letters, digits and underscores: of the stage and the entry point.
    kind : str
        A kind of stage, ``reader``, ``exporter`` or ``observer``.
    where : Path
        The folder that gets it; is made if it is missing.

    Returns
    -------
    folder : Path
    files : list of str
        Within it.

    Raises
    ------
    InputError
        For a name that will not do or is taken, for no kind, and where there is such a folder.
    """
    naming = checked_naming(name, kind)
    folder = where / naming.distribution
    if folder.exists() or folder.is_symlink():
        raise InputError(f"{folder} is there already; move it away, or choose another name")
    files = contents(naming)
    where.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{naming.distribution}-", dir=where) as holder:
        made = Path(holder) / naming.distribution
        for file, text in files.items():
            (made / file).parent.mkdir(parents=True, exist_ok=True)
            (made / file).write_text(text, encoding="utf-8")
        shutil.move(made, folder)
    return folder, list(files)


def contents(naming: Naming) -> dict[str, str]:
    """The text of every file of a plugin."""
    package = naming.package
    stage = naming.kind in KINDS
    module = "stage" if stage else naming.kind
    presets = None if not stage else "dataset" if naming.kind == "dataset" else "method"
    source = resources.files("mvreg.kit.templates") / f"{naming.kind}.py"
    found = {
        "README.md": readme(naming, module),
        "pyproject.toml": pyproject(naming, presets),
        f"{package}/__init__.py": hooks(naming, presets),
        f"{package}/{module}.py": naming.filled(source.read_text(encoding="utf-8")),
        f"{package}/py.typed": "",
    }
    if presets is not None:
        file, text = preset(naming)
        found |= {
            f"{package}/conf/__init__.py": f'"""The presets: `{presets}/{file}.yaml`."""\n',
            f"{package}/conf/{presets}/__init__.py": "",
            f"{package}/conf/{presets}/{file}.yaml": text,
        }
    return {**found, f"tests/test_{naming.name}.py": tests_of(naming)}
