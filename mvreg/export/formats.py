"""What an export format is to mvreg."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mvreg.export.placements import Component, Placements
from mvreg.types import Array

if TYPE_CHECKING:
    from mvreg.export.model import Model

#: Writes the poses of one component into a folder, and returns remarks.
PoseWriter = Callable[[Path, Component, Placements], "list[str]"]
#: Writes the points of one component into a folder, and returns remarks.
PointWriter = Callable[[Path, "Model"], "list[str]"]


@dataclass(frozen=True)
class PoseFormat:
    """Poses as another program reads them.

    Parameters
    ----------
    name : str
        As it is asked for.
    files : str
        What it writes; NAME stands for a scan's name, made safe for file systems.
    summary : str
        Whose format it is, in half a sentence.
    write : callable
        ``write(folder, component, placements)``, see `PoseWriter`.
    read : callable, optional
        ``read(folder)``: the poses ``T_model_scan`` back, by scan. None where nobody wants them.
    """

    name: str
    files: str
    summary: str
    write: PoseWriter
    read: Callable[[Path], dict[str, Array]] | None = None


@dataclass(frozen=True)
class PointFormat:
    """Points, with or without poses.

    Parameters
    ----------
    name, files, summary : str
        As of a `PoseFormat`.
    write : callable
        ``write(folder, model)``, see `PointWriter`.
    require : callable, optional
        Raises `InputError` if what the format needs is not installed.
    residuals : bool
        Points have their residuals, for which the scans must be prepared.
    """

    name: str
    files: str
    summary: str
    write: PointWriter
    require: Callable[[], object] | None = None
    residuals: bool = False


Format = PoseFormat | PointFormat
