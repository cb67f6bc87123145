"""Errors of Hydra and OmegaConf as one clear message that lists the options."""

from __future__ import annotations

import difflib
import re
import shlex
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from omegaconf.errors import (
    ConfigAttributeError,
    ConfigKeyError,
    MissingMandatoryValue,
    OmegaConfBaseException,
)

from mvreg.config.known_plugins import BROUGHT_BY, to_install
from mvreg.config.overrides import spelled
from mvreg.config.presets import choices
from mvreg.config.renamed import renamed_parameter
from mvreg.contracts import KINDS
from mvreg.errors import InputError
from mvreg.plugins import manager

#: What is wrong input when it comes out of Hydra; it raises ValueError for some overrides.
CONFIG_ERRORS = (HydraException, OmegaConfBaseException, ValueError)

#: What can stand first on the command line instead of KEY=VALUE.
WORDS = (
    "look", "inspect", "add", "export", "report", "view", "compare", "plugins", "new-plugin",
    "store",
)  # fmt: skip
NOT_IN_DEFAULTS = re.compile(r"Could not (?:override|delete) '([^']+)'\. No match in the defaults")
TWICE = re.compile(r"(?:Multiple values for )?(\S+?)(?:\. To| appears more than once in the final)")
WHERE = re.compile(r"In '([^']+)'")


@contextmanager
def explained() -> Iterator[None]:
    """Turn errors of Hydra and OmegaConf into `InputError`."""
    try:
        yield
    except InputError:
        raise
    except CONFIG_ERRORS as error:
        raise InputError(explain(error)) from error


def explain(error: Exception) -> str:
    """One message for an error of Hydra or OmegaConf."""
    cause = error.__cause__ or error.__context__
    if isinstance(error, OmegaConfBaseException) or not isinstance(cause, OmegaConfBaseException):
        cause = error
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        return no_such_choice(error.missing_cfg_file, error.options or ())
    if isinstance(error, OverrideParseException):
        return unreadable(error)
    if isinstance(cause, ConfigAttributeError | ConfigKeyError) and cause.parent_node is not None:
        missing = no_such_key(str(cause.full_key), cause.parent_node, cause.object_type)
        return f"{origin(error)}{missing}"
    if isinstance(cause, MissingMandatoryValue):
        return f"{origin(error)}{cause.full_key} needs a value: {cause.full_key}=..."
    if isinstance(cause, OmegaConfBaseException) and cause.full_key:
        if "is not a ListConfig" in first_line(cause):
            key = cause.full_key
            return f"{origin(error)}{key}: expected a list in brackets: '{key}=[FIRST,SECOND]'"
        return f"{origin(error)}{cause.full_key}: {first_line(cause)}"
    if match := NOT_IN_DEFAULTS.match(str(error)):
        names = ", ".join(choices().get(match[1], ["NAME"]))
        return f"{match[1]} is chosen with a plus: +{match[1]}=NAME; options: {names}"
    if match := TWICE.match(str(error)):
        advice = f"write {match[1]}=NAME, without a plus" if match[1] in KINDS else "name one"
        return f"{match[1]} is chosen already; {advice}"
    return " ".join(str(error).split())


def first_line(error: Exception) -> str:
    """The first line of an error's text; the others tell of OmegaConf's insides."""
    return (str(error).splitlines() or [type(error).__name__])[0]


def origin(error: Exception) -> str:
    """The preset that an error comes from, ``"method/fcpma.yaml: "``; empty for an override."""
    match = WHERE.match(str(error))
    return f"{match[1]}.yaml: " if match else ""


def no_such_choice(file: str, options: Iterable[str]) -> str:
    """For ``refine=foo``."""
    group, _, name = file.rpartition("/")
    kind, _, folder = file.partition("/")
    if kind == "dataset" and folder and Path(folder).is_dir():
        listed = ", ".join(options or choices().get(kind, ()))
        return f"dataset={folder} is no data set: {a_folder(folder)}; data sets: {listed}"
    if file == "hydra/launcher/joblib":
        return "hydra/launcher=joblib is not installed: pip install hydra-joblib-launcher"
    plus = "" if group in (*KINDS, "executor") or group.startswith("hydra/") or not group else "+"
    if package := BROUGHT_BY.get(file):
        return to_install(f"{plus}{group}={name}", package)
    listed = ", ".join(options or choices().get(group, ())) or "none"
    if group in KINDS:
        return f"{group}={name} is not registered; options: {listed}"
    return f"{plus}{group or 'config'}={name} does not exist; options: {listed}"


def no_such_key(key: str, known: Iterable[str], cls: type | None = None) -> str:
    """For ``seed.top_fractoin=1``: `known` are the keys beside it, `cls` the stage's class."""
    names = [name for name in map(str, known) if name != "hydra"]
    now = renamed_parameter(key)
    if now and now.rpartition(".")[2] in names:
        return f"{key} has been renamed to {now}; write {now}=..."
    stage = {stage.cls: stage for stage in manager.stages().values()}.get(cls or object)
    owner = f"parameters of {stage.kind}={stage.name}" if stage else "keys"
    near = difflib.get_close_matches(key.rpartition(".")[2], names, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    if stage is None and "." not in key:
        kinds = dict.fromkeys(s.kind for s in manager.stages().values() if key in s.parameters)
        full = " or ".join(f"{kind}.{key}" for kind in kinds)
        hint = f"did you mean {full}? " if full else hint
    return f"{key} does not exist; {hint}{owner}: {', '.join(names) or 'none'}"


def unreadable(error: OverrideParseException) -> str:
    """For what is no override at all."""
    if error.override.startswith("-"):
        return f"unknown option {error.override}; see mvreg --help"
    reason = str(error).split("\nSee ")[0].splitlines()[-1].strip(" ^")
    detail = f" ({reason})" if reason and "<EOF>" not in reason else ""
    key, equals, value = error.override.partition("=")
    if equals and value and re.fullmatch(r"[+~]*[\w./@-]+", key):
        quoted = f"{key}={spelled(value)}"
        quoted = shlex.quote(quoted) if re.search(r'["$`\\]', quoted) else f'"{quoted}"'
        return f"cannot read {error.override!r}{detail}; quote the value twice: {quoted}"
    if Path(error.override).is_dir():
        return f"cannot read {error.override!r}: {a_folder(error.override)}"
    near = difflib.get_close_matches(error.override, WORDS, n=1)
    hint = f"did you mean mvreg {near[0]}? " if near else ""
    return (
        f"cannot read {error.override!r}{detail}; {hint}expected KEY=VALUE, or first the word "
        f"{', '.join(WORDS[:-1])} or {WORDS[-1]}; see mvreg --help"
    )


def a_folder(name: str) -> str:
    """What is said where the name of a folder stands for its scans."""
    path = shlex.quote(f"dataset.path={name}")
    return (
        f"it is a folder; mvreg dataset=folder {path} registers the scans in it, "
        f"mvreg look {shlex.quote(name)} shows what is read of them"
    )
