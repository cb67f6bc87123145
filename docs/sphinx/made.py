"""Pages that are made from the program: command line, configuration, stages, and what is public."""

from __future__ import annotations

import contextlib
import inspect
import io
import os
import sys
from collections.abc import Iterator
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from unittest import mock

from layout import ROOT
from sphinx.ext.napoleon import Config, NumpyDocstring

from mvreg.cli.listing import shown
from mvreg.cli.main import COMMANDS, main
from mvreg.contracts import KINDS
from mvreg.execution import EXECUTORS
from mvreg.plugins import manager
from mvreg.plugins.registry import REQUIRED, Registered, default

sys.path.insert(0, str(ROOT / "tests" / "documents"))
from api import PUBLIC, VALUES, names, summary

PARAMETERS = "Parameters\n----------\n"
NAPOLEON = Config(napoleon_use_param=False, napoleon_use_rtype=False)


def pages() -> dict[str, str]:
    """The text of every such page, by its file on the site."""
    found = {
        "reference/command_line.md": command_line(),
        "reference/configuration.md": configuration(),
        "reference/stages.md": stages(),
        "reference/api/index.md": api_index(),
    }
    seen: dict[int, str] = {}
    for path in reversed(PUBLIC):  # the root last: what others have too, it only points to
        found[f"reference/api/{path}.md"] = api_page(path, seen)
    return found


def said(*words: str) -> str:
    """What the program prints, ninety columns wide."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), mock.patch.dict(os.environ, COLUMNS="90", NO_COLOR="1"):
        code = main(words)
    if code:
        raise RuntimeError(f"mvreg {' '.join(words)} ended with {code}")
    return out.getvalue().rstrip()


def console(text: str) -> str:
    """A block of what a terminal shows."""
    return f"```text\n{text}\n```\n"


def command_line() -> str:
    """``mvreg --help``, and that of every subcommand."""
    parts = [
        "# Command line",
        "As the program prints it, with the plugins of the repository installed. What goes with "
        "`KIND=` and `KIND.PARAMETER=` is on the page of [stages](stages.md), all other keys on "
        "that of the [configuration](configuration.md).",
        "## mvreg",
        console(said("--help")),
    ]
    for command in COMMANDS:
        parts += [f"## mvreg {command}", console(said(command, "--help"))]
    return "\n\n".join(parts)


def configuration() -> str:
    """What Hydra composes a run from: defaults, methods, presets, experiments, executors."""
    conf = ROOT / "conf"
    parts = [
        "# Configuration",
        "A run is composed by [Hydra](https://hydra.cc) from files in YAML, which name stages and "
        "say where a parameter differs from its default; defaults themselves are those of the "
        "[stages](stages.md). `mvreg +method=fcpma --cfg job` prints what a command composes. "
        "Files of yours need no place in mvreg: `mvreg --config-dir DIR +method=mine` looks into "
        "`DIR/method` as well.",
        "## Keys, and the stages of the default method",
        yaml(conf / "config.yaml"),
        "## Executors",
        "`executor=NAME` says who works; see [many scans, many machines](../scale.md).",
    ]
    for name, cls in EXECUTORS.items():
        parts += [f"### executor={name}", *described(cls, "executor")]
    for group, title in (("method", "Methods"), ("dataset", "Presets of data sets"),
                         ("experiment", "Experiments")):  # fmt: skip
        parts.append(f"## {title}")
        for file in sorted((conf / group).glob("*.yaml")):
            parts += [f"### {'' if group == 'dataset' else '+'}{group}={file.stem}", yaml(file)]
    for group in ("describe", "propagate", "seed"):
        for file in sorted((conf / group).glob("*.yaml")):
            parts += [f"## {group}={file.stem}", yaml(file)]
    return "\n\n".join(parts)


def yaml(file: Path) -> str:
    """A file of the configuration, as it is."""
    return f"```yaml\n{file.read_text('utf-8').rstrip()}\n```\n"


def stages() -> str:
    """Every registered stage with its parameters."""
    parts = [
        "# Stages and their parameters",
        "Every step of a run is a stage, chosen by `KIND=NAME`, whose parameters are set by "
        "`KIND.PARAMETER=VALUE`. This page is what the table of stages held when the site was "
        "built, with the plugins of the repository; `mvreg plugins` prints what you have. What a "
        "stage of each kind must do is in [mvreg.contracts](api/mvreg.contracts.md).",
    ]
    for kind, protocol in KINDS.items():
        parts += [f"## {kind}", (protocol.__doc__ or "").splitlines()[0]]
        for stage in manager.stages().values():
            if stage.kind == kind:
                parts += stage_lines(stage)
    return "\n\n".join(parts)


def stage_lines(stage: Registered) -> Iterator[str]:
    """The paragraphs about one stage."""
    yield f"### {stage.kind}={stage.name}"
    yield from described(stage.cls, stage.kind)
    yield f"*Registered by `{stage.plugin}` of {stage.origin}.*"


def described(cls: type, kind: str) -> Iterator[str]:
    """The docstring of a stage, and its parameters as on the command line."""
    text = inspect.cleandoc(cls.__doc__ or "")
    for base in cls.__mro__[1:]:
        inherited = inspect.cleandoc(base.__doc__ or "").partition(PARAMETERS)[2]
        if base.__module__ != "builtins" and inherited and PARAMETERS not in text:
            text += f"\n\n{PARAMETERS}{inherited}"
        elif inherited and base.__module__ != "builtins":
            text += "\n" + inherited.partition("\n\n")[0]
    rst = str(NumpyDocstring(text, NAPOLEON, what="class", name=cls.__name__))
    yield f"````{{eval-rst}}\n{rst.rstrip()}\n````"
    lines = []
    for field in fields(cls):  # type: ignore[arg-type]
        value = default(field)
        if field.init:
            lines.append(f"{kind}.{field.name}={'...' if value == REQUIRED else shown(value)}")
    if lines:
        yield "Defaults:\n\n" + console("\n".join(lines))


def api_index() -> str:
    """The modules that programs and plugins may import."""
    lines = [f"- [{path}]({path}.md): {summary(path, import_module(path))}" for path in PUBLIC]
    head = (
        "# What is public\n\nPlugins and programs import from these modules, and from no other: "
        "all else may change from one version to the next.\n\n"
    )
    return head + "\n".join(lines) + "\n"


def api_page(path: str, seen: dict[int, str]) -> str:
    """All the names of a public module; what another page has is named there.

    `seen` has the pages of what was described before, by identity, and is added to.
    """
    module = import_module(path)
    parts = [f"# {path}", inspect.cleandoc(module.__doc__ or "").split("\n\n")[0]]
    elsewhere, here, values = [], [], []
    for name in names(module):
        value = getattr(module, name)
        if name in VALUES and not inspect.isclass(value):
            values.append(f"- `{name}`: {VALUES[name]}")
        elif inspect.ismodule(value):
            elsewhere.append(f"- [{name}]({path}.{name}.md): {summary(name, value)}")
        elif id(value) in seen:
            role = f"{{py:obj}}`{name} <{seen[id(value)]}.{name}>`"
            elsewhere.append(f"- {role}: {summary(name, value)}")
        else:
            seen[id(value)] = path
            what = "autoclass" if inspect.isclass(value) else "autofunction"
            # Of a contract, how a stage is called is what matters.
            called = "   :special-members: __call__\n" if getattr(value, "_is_protocol", 0) else ""
            here.append(f"```{{eval-rst}}\n.. {what}:: {path}.{name}\n{called}```")
    if values:
        parts.append("\n".join(values))
    if elsewhere:
        parts.append("Described elsewhere:\n\n" + "\n".join(elsewhere))
    return "\n\n".join([*parts, *here]) + "\n"
