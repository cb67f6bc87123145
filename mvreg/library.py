"""What a program calls: load scans, register them, prepare them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mvreg.config.overrides import overrides_from, spelled
from mvreg.errors import InputError
from mvreg.execution.threads import Executor
from mvreg.initial import in_their_frame
from mvreg.pipeline import THREADS
from mvreg.plugins import manager
from mvreg.progress import CancelledError, Listener, Reporter, Stop
from mvreg.run import Method, load_method, load_scans, run
from mvreg.store.folder import open_store
from mvreg.types import Result, Scans, ScanSet, View
from mvreg.types.given import as_scans

#: Gigabytes that the store of a library call may take; on the command line ``store_size`` says so.
STORE_SIZE = 5.0


def dataset(name: str, rng: int = 0, **parameters: object) -> ScanSet:
    """Load a data set: ``dataset("bunny")``, ``dataset("folder", path="scans")``.

    Parameters
    ----------
    name : str
        A registered data set or a preset; ``python -m mvreg plugins dataset`` lists them.
    rng : int
        For an order or motions drawn at random.
    **parameters
        The data set's own, such as ``order="shuffle"``.

    Raises
    ------
    InputError
        If there is no such data set or parameter, or the scans cannot be read.
    """
    from mvreg.config.compose import compose

    changes = {f"dataset.{key}": value for key, value in parameters.items()}
    config = compose([f"dataset={spelled(name)}", *overrides_from(changes)])
    return load_scans(config, rng)


def register(
    scans: Scans,
    method: str | Method = "auto",
    rng: int = 0,
    changes: Mapping[str, object] | None = None,
    observers: Sequence[object] = (),
    store: bool | str | Path = False,
    executor: Executor = THREADS,
    progress: Listener | None = None,
) -> Result:
    """Find the poses of unordered scans.

    Parameters
    ----------
    scans : ScanSet, sequence, or mapping of names
        Each a `Scan`, an array (N, 3), or what looks like points, see `mvreg.types.PointLike`. At
        least two, in any order, each in a frame of its own, all in the same unit of length.
    method : str or Method
        A method's name ("fcpma"), or one put together by hand.
    rng : int
        Everything random follows from it.
    changes : mapping, optional
        Other stages or parameters: ``{"refine": "icp", "seed.top_fraction": 0.5}``.
    observers : sequence of objects
        With a hook ``mvreg_event(event)``, told what happens.
    store : bool or path
        Where finished work is kept, and found instead of done again: a folder, or True for that of
        the command line, see `mvreg.store`.
    executor : Executor
        Who works: `mvreg.execution.Threads`, `Dask` or `Shards`; the last two need a `store`.
    progress : callable, optional
        Called with an `mvreg.Progress` at every event: before the first scan, for every scan and
        pair, and before the poses are adjusted, in the thread of the caller. Answers it False, the
        registration ends with a `CancelledError`; what it raises ends the registration, too, and
        comes out as it is. An attempt that has begun, and the adjustment, are not cut short.

    Returns
    -------
    Result
        `poses` maps names to ``T_model_scan`` (4, 4) in the unit of the scans, the identity for
        `reference`; `unregistered` names the scans that could not be placed. They are not in
        `poses`. `views` are the scans as the method prepared them, for `mvreg.assess`.

    Raises
    ------
    InputError
        For fewer than two scans, arrays that are not (N, 3) or not finite, an unknown method,
        stage or parameter.
    StageError
        If a stage raises an error, or returns what its contract does not allow; names the stage
        and the distribution that it came with.
    CancelledError
        If `progress` answers False; has the result of what was placed by then. With a `store`, the
        same call goes on from there.
    """
    method, generator, given = _method(method, changes), _generator(rng), as_scans(scans)
    names = [scan.name for scan in given]
    told = None if progress is None else Reporter(progress, names, manager.emit)
    kept = open_store(store, STORE_SIZE)
    try:
        with manager.observing(*observers):
            if told is not None:
                told.tell()
            emit = told or manager.emit
            result, views, _ = run(given, method, generator, emit, kept, executor)
    except Stop as stop:
        cause = stop.cause
    else:
        return replace(result, views=tuple(views))
    # Outside of the handler: by now the frames of the run are gone, and with them its queued work.
    if cause is not None:
        raise cause
    so_far = None if told is None else told.so_far()
    raise CancelledError(None if so_far is None else in_their_frame(so_far, given))


def prepare(
    scans: Scans,
    method: str | Method = "auto",
    rng: int = 0,
    changes: Mapping[str, object] | None = None,
) -> list[View]:
    """Down-sample and describe scans as a method does before it registers them.

    Parameters
    ----------
    scans, method, rng, changes
        As in `register`, which given the same makes the same views.

    Returns
    -------
    list of View
        In the order of the scans.

    Raises
    ------
    InputError
        As `register` does.
    """
    method, generator = _method(method, changes), _generator(rng)
    return method.pipeline.prepare(as_scans(scans), generator)


def _generator(rng: int) -> np.random.Generator:
    if rng < 0:
        raise InputError(f"rng: expected a whole number, 0 or more, got {rng}")
    return np.random.default_rng(rng)


def _method(method: str | Method, changes: Mapping[str, object] | None) -> Method:
    if isinstance(method, str):
        return load_method(method, changes)
    if changes:
        raise InputError("changes go with a method's name; this method is put together already")
    return method
