"""The workers of a Dask cluster: on this machine, or wherever a scheduler has them.

Nothing large goes through the scheduler. Scans are entries of the store, which all workers see, and
are read there; so are the answers. A task that is worked on twice, since a worker was lost, gives
the same entry twice.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from mvreg.contracts import Pipeline, Task
from mvreg.errors import InputError
from mvreg.execution.threads import Workers
from mvreg.execution.work import answer, key_of
from mvreg.execution.worker import DERIVED, work_on
from mvreg.parallel import threads
from mvreg.store.content import digest, versions
from mvreg.store.folder import FolderStore, Store
from mvreg.types import View

if TYPE_CHECKING:
    from distributed import Client

#: Tiles for every worker in a round: enough to even out what they take, few for the scheduler.
TILES_PER_WORKER = 4
#: Tasks in a tile at most: it takes seconds, and losing it costs no more.
MOST_IN_A_TILE = 16
#: Bytes for the libraries of a worker.
LIBRARIES = 400 * 2**20
#: Scans that a worker on this machine has room for, at least.
LEAST_SCANS = 64
#: One thread each, whatever the library: there is a worker for every core.
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "TBB_NUM_THREADS"), "1"
)


@dataclass(frozen=True)
class Dask:
    """Works in the workers of a Dask cluster (``pip install mvreg[dask]``).

    Parameters
    ----------
    address : str
        Of a scheduler, ``tcp://host:8786``, as dask-jobqueue starts one on Slurm; empty starts
        workers on this machine, that listen to nobody else.
    workers : int
        How many to start on this machine; 0 for one for each core.
    dashboard : bool
        Show Dask's dashboard on this machine, at port 8787.
    ca_file, cert_file, key_file : str
        For a scheduler that speaks TLS, ``tls://host:8786``.
    timeout : float
        Seconds to wait for the scheduler and for the first worker.
    """

    address: str = ""
    workers: int = 0
    dashboard: bool = False
    ca_file: str = ""
    cert_file: str = ""
    key_file: str = ""
    timeout: float = 60.0

    def __post_init__(self) -> None:
        if self.workers < 0 or not self.timeout > 0:
            raise InputError(
                f"executor: expected workers of 0 or more and a timeout above 0, got "
                f"{self.workers} and {self.timeout}"
            )

    @contextmanager
    def session(self, store: Store) -> Iterator[Workers]:
        """Connect to the scheduler, or start workers here and end them afterwards.

        Raises
        ------
        InputError
            Without Dask, without a store, or if nobody answers at the address.
        """
        if not isinstance(store, FolderStore):
            raise InputError(
                "executor=dask: expected a store that all workers see, got store=false; name a "
                "folder on a disk that they share: store=DIR"
            )
        try:
            import distributed  # noqa: F401
        except ImportError:
            raise InputError("executor=dask needs Dask: pip install 'mvreg[dask]'") from None
        with self.client(store) as client:
            yield Session(client)

    @contextmanager
    def client(self, store: FolderStore) -> Iterator[Client]:
        """A client, connected."""
        import dask
        import distributed

        connect: Any = distributed.Client

        if self.address:
            try:
                client = connect(self.address, timeout=self.timeout, security=self.security())
                client.wait_for_workers(1, timeout=self.timeout)
            except (OSError, TimeoutError) as error:
                raise InputError(
                    f"executor.address={self.address}: expected a scheduler with workers, within "
                    f"{self.timeout:g} s ({error}); start them, or leave the address out"
                ) from None
            with client:
                yield client
            return
        started = {
            "n_workers": self.workers or threads(), "threads_per_worker": 1, "processes": True,
            "host": "127.0.0.1", "memory_limit": memory_limit(store, self.workers or threads()),
            "dashboard_address": "127.0.0.1:8787" if self.dashboard else None,
            "silence_logs": logging.CRITICAL,
        }  # fmt: skip
        environment = {"distributed.nanny.pre-spawn-environ": ONE_THREAD}
        cluster: Any = distributed.LocalCluster
        with (
            dask.config.set(environment),
            cluster(**started) as here,
            connect(here) as client,
        ):
            yield client

    def security(self) -> Any:
        """What the connection is encrypted with; None for none."""
        from distributed.security import Security

        make: Any = Security
        return make(
            tls_ca_file=self.ca_file, tls_client_cert=self.cert_file or None,
            tls_client_key=self.key_file or None, require_encryption=True,
        ) if self.ca_file else None  # fmt: skip


def memory_limit(store: FolderStore, workers: int) -> int:
    """Bytes for a worker on this machine: Dask's own share, or what its scans will need if more.

    Dask pauses workers at 80 per cent of a limit, and restarts them at 95.
    """
    import psutil

    sizes = sorted(size for _, size, _ in store.known())
    scan = sizes[int(0.9 * len(sizes))] if sizes else 2**20
    needed = LIBRARIES + LEAST_SCANS * DERIVED * scan
    return int(max(psutil.virtual_memory().total / workers, needed))


@dataclass(frozen=True)
class Session:
    """The workers while a run lasts."""

    client: Client

    def __call__(
        self, tasks: Sequence[Task], views: Sequence[View], pipeline: Pipeline, store: Store
    ) -> Iterator[Any]:
        assert isinstance(store, FolderStore)
        keys = [key_of(task, [views[k] for k in task.members], pipeline) for task in tasks]
        away = [
            k for k, key in enumerate(keys)
            if key is not None and len(tasks) > 1 and not store.has(key)
        ]  # fmt: skip
        futures = self.send(away, keys, tasks, views, pipeline, store)
        for k, task in enumerate(tasks):
            members, before = [views[m] for m in task.members], store.use.found
            if k in futures:
                finished(futures[k], store)
            found = answer(task, members, pipeline, store, keys[k])
            if k in futures:
                store.use.found = before  # it is of this run
            yield found

    def send(
        self,
        away: Sequence[int],
        keys: Sequence[str | None],
        tasks: Sequence[Task],
        views: Sequence[View],
        pipeline: Pipeline,
        store: FolderStore,
    ) -> dict[int, Any]:
        """Give tasks to the workers, in tiles: for each task the future of its tile."""
        named = {k: self.read_there(views[k], store) for i in away for k in tasks[i].members}
        stages = pipeline.without_surroundings()
        futures: dict[int, Any] = {}
        workers = len(self.client.scheduler_info()["workers"])
        for first, last in pairwise(cuts(len(away), workers)):
            part = away[first:last]
            tile = [(keys[i], tasks[i], [named[k] for k in tasks[i].members]) for i in part]
            name = f"{type(tasks[part[0]]).__name__.lower()}-{digest(*(keys[i] for i in part))}"
            future = self.client.submit(work_on, tile, stages, store, pure=False, key=name)
            futures |= dict.fromkeys(part, future)
        return futures

    def read_there(self, view: View, store: FolderStore) -> str:
        """The key of a view's entry, which is written if need be."""
        key = digest(versions(), "view", view)
        if not store.has(key):
            store.keep(key, view)
        return key


def cuts(count: int, workers: int) -> list[int]:
    """Where the tiles of so many tasks begin, and where the last one ends."""
    size = min(MOST_IN_A_TILE, max(1, count // (TILES_PER_WORKER * max(1, workers))))
    return [*range(0, count, size), count] if count else []


def finished(future: Any, store: FolderStore) -> None:
    """Wait for a tile.

    Raises
    ------
    InputError
        If every worker that took it was lost.
    """
    from distributed import KilledWorker

    try:
        future.result()
    except KilledWorker as error:
        raise InputError(
            f"a tile of the work ended every worker that took it ({error}); they may need more "
            f"memory, or executor.workers fewer at once; what was finished is in {store.folder}, "
            "and the same command goes on from there"
        ) from None
