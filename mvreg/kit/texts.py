"""What the files of a new plugin beside its code say."""

from __future__ import annotations

from mvreg.contracts import KINDS
from mvreg.kit.naming import Naming

#: The stages of a method to begin with: FCPMA's, of the paper.
STAGES = {
    "downsample": "paper", "describe": "spectrum", "seed": "nearest", "propagate": "consensus",
    "refine": "tricp", "judge": "tmse_surface", "augment": "merge", "strategy": "grow",
    "adjust": "none",
}  # fmt: skip


def what_it_is(naming: Naming) -> str:
    """The plugin in a few words."""
    match naming.kind:
        case "reader":
            return f"the file format .{naming.name}"
        case "exporter":
            return f"the export format {naming.name}"
        case "observer":
            return "an observer of runs"
        case "dataset":
            return f"the data set dataset={naming.name}"
    return f"the stage {naming.kind}={naming.name}"


def pyproject(naming: Naming, presets: str | None) -> str:
    """``pyproject.toml``; `presets` is the folder within ``conf`` that has one."""
    package = naming.package
    packages = [package] + [f"{package}.conf", f"{package}.conf.{presets}"] * (presets is not None)
    listed = ", ".join(f'"{one}"' for one in packages)
    data = f'"{package}.conf.{presets}" = ["*.yaml"]\n' if presets is not None else ""
    return f"""\
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "{naming.distribution}"
version = "0.1.0"
description = "A plugin of mvreg: {what_it_is(naming)}"
readme = "README.md"
requires-python = ">=3.11"
dependencies = ["mvreg", "numpy>=2.0"]

[project.entry-points.mvreg]
{naming.name} = "{package}"

[tool.setuptools]
packages = [{listed}]

[tool.setuptools.package-data]
{package} = ["py.typed"]
{data}"""


def hooks(naming: Naming, presets: str | None) -> str:
    """``__init__.py``: what mvreg asks the plugin."""
    head = (
        f'"""A plugin of mvreg: {what_it_is(naming)}."""\n\nfrom __future__ import annotations\n\n'
    )
    package = naming.package
    if naming.kind == "reader":
        return head + naming.filled(f"""\
from typing import TYPE_CHECKING

import mvreg

if TYPE_CHECKING:
    from mvreg.io import Format


@mvreg.hookimpl
def mvreg_formats() -> list[Format]:
    \"\"\"Return the file formats.\"\"\"
    from {package}.reader import NAMELESS

    return [NAMELESS]
""")
    if naming.kind == "exporter":
        return head + naming.filled(f"""\
from typing import TYPE_CHECKING

import mvreg

if TYPE_CHECKING:
    from mvreg.export import PoseFormat


@mvreg.hookimpl
def mvreg_exports() -> list[PoseFormat]:
    \"\"\"Return the formats that runs can be exported to.\"\"\"
    from {package}.exporter import NAMELESS

    return [NAMELESS]
""")
    if naming.kind == "observer":
        return head + naming.filled(f"""\
import mvreg
from mvreg.events import Event
from {package}.observer import NamelessObserver

OBSERVER = NamelessObserver()


@mvreg.hookimpl
def mvreg_event(event: Event) -> None:
    \"\"\"Pass an event on.\"\"\"
    OBSERVER.mvreg_event(event)
""")
    return (
        head
        + f"""\
import mvreg


@mvreg.hookimpl
def mvreg_stages() -> dict[str, type]:
    \"\"\"Return the stages; what they need is imported when it is asked for.\"\"\"
    from {package}.stage import {naming.cls}

    return {{"{naming.kind}/{naming.name}": {naming.cls}}}


@mvreg.hookimpl
def mvreg_config_path() -> str:
    \"\"\"Return where the presets are: those in ``conf/{presets}``.\"\"\"
    return "pkg://{package}.conf"
"""
    )


def preset(naming: Naming) -> tuple[str, str]:
    """The name of the preset and its text."""
    if naming.kind == "dataset":
        return f"{naming.name}_dense", (
            f"# dataset={naming.name}_dense: the same with twice as many points.\n"
            f"defaults: [{naming.name}, _self_]\npoints: 24000\n"
        )
    stages = {**STAGES, naming.kind: naming.name}
    lines = "".join(f"  - override /{kind}: {stage}\n" for kind, stage in stages.items())
    return naming.name, (
        f"# @package _global_\n# FCPMA of the paper, with {naming.kind}={naming.name}.\n"
        f"defaults:\n{lines}\nmethod: {naming.name}\n"
    )


def readme(naming: Naming, module: str) -> str:
    """``README.md``."""
    name, package = naming.name, naming.package
    use = {
        "dataset": f"mvreg dataset={name}\nmvreg dataset={name}_dense",
        "reader": "mvreg look FOLDER\nmvreg dataset=folder dataset.path=FOLDER",
        "exporter": (
            f"mvreg dataset=tiny 'export=[{name}]'\nmvreg export runs/tiny/auto/latest {name}"
        ),
        "observer": "mvreg dataset=tiny",
        # The default method pools the evidence of pairs, which only judge=evidence can.
        "judge": f"mvreg +method={name} dataset=tiny",
    }.get(
        naming.kind, f"mvreg +method={name} dataset=tiny\nmvreg {naming.kind}={name} dataset=tiny"
    )
    contract = (
        f"`mvreg.contracts.{KINDS[naming.kind].__name__}` says what the stage must do, and\n"
        f"`mvreg.testing.{KINDS[naming.kind].__name__}Contract` tests it."
        if naming.kind in KINDS
        else {
            "reader": "`mvreg.io.Format` says\nwhat the hook returns, and "
            "`mvreg.testing.ReaderContract` tests it.",
            "exporter": "`mvreg.export.PoseFormat` and\n`mvreg.export.PointFormat` say what "
            "the hook returns, and `mvreg.testing.ExportContract` tests it.",
            "observer": "`mvreg.events` has the\nevents that the hook is told.",
        }[naming.kind]
    )
    return f"""\
# {naming.distribution}

A plugin of mvreg: {what_it_is(naming)}. It works as it is, and is there to be changed:
[{package}/{module}.py]({package}/{module}.py). {contract}

```sh
pip install -e .
mvreg plugins check {name}
{use}
pytest
```
"""
