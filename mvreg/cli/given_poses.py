"""A report of poses that something else found: the judge without the registration."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io.scan_names import matched, unused
from mvreg.types import Array, Result, ScanSet

METHOD = "given"


def judge(poses: Path, folder: Path, changes: Sequence[str] = (), out: Path | None = None) -> bool:
    """Assess given poses of the scans in a folder; write a run folder, and print its table.

    Parameters
    ----------
    poses : Path
        What `mvreg.io.read_poses` reads; ``T_world_scan``, in any frame.
    folder : Path
        The scans, as for ``dataset=folder``.
    changes : sequence of str
        As on the command line: ``dataset.unit=mm``.
    out : Path, optional
        The folder to write to; ``runs/FOLDER/given/TIME`` if not given.

    Returns
    -------
    bool
        Whether every scan has a pose.

    Raises
    ------
    InputError
        If poses or scans cannot be read, or no pose is of any of the scans.
    """
    from omegaconf import OmegaConf

    from mvreg.cli.prepared import prepared
    from mvreg.config.compose import check, compose
    from mvreg.config.overrides import spelled
    from mvreg.io.poses import read_poses_and_remarks
    from mvreg.report.build import build_report

    known, rounded = read_poses_and_remarks(poses)
    words = ["dataset=folder", f"dataset.path={spelled(str(folder.resolve()))}", *changes]
    config = compose(words)
    check(config)
    start = time.perf_counter()
    scanset, views = prepared(config)
    loading = time.perf_counter() - start
    result, unmeant = given(known, scanset, poses)
    result = replace(result, views=tuple(views))
    remark = (
        f"the poses are those of {poses.name}, in the frame of {result.reference}; nothing was "
        "registered"
    )
    scanset = replace(scanset, remarks=(*scanset.remarks, *rounded, *unmeant, remark))
    plain: dict[str, Any] = OmegaConf.to_container(config, resolve=True, enum_to_str=True)  # type: ignore[assignment]
    report = build_report(
        scanset, views, result, method=METHOD, rng=config.rng,
        seconds={"load": loading, "total": time.perf_counter() - start}, config=plain,
    )  # fmt: skip
    moment = f"{datetime.now():%Y-%m-%d_%H-%M-%S-%f}"
    write(out or Path("runs", scanset.name, METHOD, moment), words, report, scanset, result)
    return not result.unregistered


def given(
    known: Mapping[str, Array], scanset: ScanSet, file: Path
) -> tuple[Result, tuple[str, ...]]:
    """A result with given poses, in the frame of the first scan that has one, and remarks.

    Poses and scans go together by name, see `mvreg.io.scan_names.matched`.
    """
    names = [scan.name for scan in scanset.scans]
    whose = {scan: pose for pose, scan in matched(known, names, str(file)).items()}
    poses = {name: known[whose[name]] for name in names if name in whose}
    if not poses:
        raise InputError(
            f"{file}: expected poses of the scans in the folder, {', '.join(names[:5])}; found "
            f"poses of {', '.join(list(known)[:5])}; scans and poses go together by file name"
        )
    reference = next(iter(poses))
    inverse = se3.invert(poses[reference])
    moved = {name: inverse @ pose for name, pose in poses.items()} | {reference: np.eye(4)}
    lost = tuple(name for name in names if name not in poses)
    return Result(reference, moved, lost, ()), unused(known, whose.values(), file)


def write(
    folder: Path,
    words: Sequence[str],
    report: Mapping[str, Any],
    scanset: ScanSet,
    result: Result,
) -> None:
    """The files of a run, and what was said to get them, so that the page can be made again."""
    from omegaconf import OmegaConf

    from mvreg.report.finished import show_run, write_run
    from mvreg.report.run_folder import write_text
    from mvreg.report.table import render

    try:
        (folder / ".hydra").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot write the run folder {folder}: {error.strerror or error}; choose another "
            "with --out FOLDER"
        ) from None
    write_text(folder / ".hydra" / "overrides.yaml", OmegaConf.to_yaml(OmegaConf.create([*words])))
    write_run(folder, scanset, result, report)
    show_run(folder, scanset, report, result.views)
    render(report, folder)
