"""One task, worked out or found in the store."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mvreg.contracts import Pipeline, Task
from mvreg.store.content import UnknownContentError, digest, plain_class, stage_digest, versions
from mvreg.store.folder import NoStore, Store
from mvreg.types import View


def key_of(task: Task, views: Sequence[View], pipeline: Pipeline) -> str | None:
    """What the answer to a task is kept under: all that it follows from.

    Parameters
    ----------
    task : Task
    views : sequence of View
        Its members.
    pipeline : Pipeline

    Returns
    -------
    str or None
        None for a task, a stage or a view that cannot be told by its content.
    """
    kinds = getattr(task, "kinds", None)
    if kinds is None:
        return None
    cls = plain_class(task)
    try:
        stages = [stage_digest(getattr(pipeline, kind)) for kind in kinds]
        return digest(versions(), f"{cls.__module__}.{cls.__qualname__}", task, stages, views)
    except UnknownContentError:
        return None


def worked(task: Task, views: Sequence[View], pipeline: Pipeline, store: Store) -> Any:
    """The answer to a task; `views` are its members."""
    key = None if isinstance(store, NoStore) else key_of(task, views, pipeline)
    return answer(task, views, pipeline, store, key)


def answer(
    task: Task, views: Sequence[View], pipeline: Pipeline, store: Store, key: str | None
) -> Any:
    """As `worked`, of a task whose key is known."""
    return found_or_made(
        store, lambda: key, lambda: task(views, pipeline), getattr(task, "answers", ())
    )


def found_or_made(
    store: Store,
    key_of: Callable[[], str | None],
    make: Callable[[], Any],
    classes: Sequence[type] = (),
) -> Any:
    """What the store has under a key, or what is made and then kept there.

    Parameters
    ----------
    store : Store
    key_of : callable
        Asked only where something is kept; None for what cannot be.
    make : callable
    classes : sequence of type
        Of the records in the value, besides those of `mvreg.types`.
    """
    key = None if isinstance(store, NoStore) else key_of()
    if key is None:
        return make()
    found = store.find(key, *classes)
    if found is None:
        found = make()
        store.keep(key, found)
    return found
