"""What a worker of a Dask cluster does: reads scans from the store, and leaves answers there."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from functools import cache

from mvreg.contracts import Pipeline, Task
from mvreg.errors import InputError
from mvreg.parallel import INSIDE
from mvreg.store.folder import FolderStore
from mvreg.types import View

#: Of a worker's memory the scans that it has read may take so much.
SHARE_OF_SCANS = 0.4
#: Bytes of a scan with all that is derived of it, per byte of its entry.
DERIVED = 8


class Scans:
    """The views that a worker has read, the last ones, within a share of its memory."""

    def __init__(self, most_bytes: int) -> None:
        self.most_bytes, self.bytes = most_bytes, 0
        self.held: OrderedDict[str, tuple[View, int]] = OrderedDict()

    def get(self, key: str, store: FolderStore) -> View:
        """A view by the key of its entry."""
        if key in self.held:
            self.held.move_to_end(key)
            return self.held[key][0]
        view: View | None = store.find(key)
        if view is None:
            raise InputError(
                f"{store.file(key)}: expected a prepared scan, found none or a damaged one; is "
                "store=DIR on a disk that all workers see, and store_size large enough?"
            )
        size = DERIVED * store.file(key).stat().st_size
        self.held[key] = (view, size)
        self.bytes += size
        while self.bytes > self.most_bytes and len(self.held) > 1:
            _, (_, less) = self.held.popitem(last=False)
            self.bytes -= less
        return view


@cache
def scans() -> Scans:
    """Those of this worker."""
    from distributed import get_worker

    limit = get_worker().memory_manager.memory_limit or 4 * 2**30
    return Scans(int(SHARE_OF_SCANS * limit))


def work_on(
    tile: Sequence[tuple[str, Task, Sequence[str]]], pipeline: Pipeline, store: FolderStore
) -> int:
    """Work on the tasks of a tile, in a worker; the answers are in the store. Says how many.

    Parameters
    ----------
    tile : sequence of (str, Task, sequence of str)
        The key of each answer, the task, and the keys of its members.
    pipeline : Pipeline
    store : FolderStore
    """
    INSIDE.busy = True  # there is a worker for every core: no further threads
    for key, task, names in tile:
        if not store.has(key):
            store.keep(key, task([scans().get(name, store) for name in names], pipeline))
    if store.use.trouble:
        raise OSError(store.use.trouble)
    return len(tile)
