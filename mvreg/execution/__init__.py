"""Who works on the tasks of a run: the threads of this process, or workers elsewhere."""

from mvreg.execution.dask import Dask
from mvreg.execution.shards import Shards
from mvreg.execution.threads import Threads

#: The executors by name: ``executor=dask``.
EXECUTORS = {"threads": Threads, "dask": Dask, "shards": Shards}

__all__ = ["Dask", "Shards", "Threads"]
