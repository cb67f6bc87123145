"""Properties that are computed once, on first access."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import wraps
from threading import Lock
from typing import Any, Generic, TypeVar
from weakref import ref

from mvreg.parallel import threads

Value = TypeVar("Value")
Owner = TypeVar("Owner")


class lazy(Generic[Value]):  # noqa: N801, a decorator
    """`functools.cached_property` as it is from Python 3.12 on: without a lock.

    Before, all instances of a class share one, and threads that build the trees of different scans
    wait for each other. Two threads that ask one instance at the same time may both work it out.
    """

    def __init__(self, function: Callable[[Any], Value]) -> None:
        self.function = function
        self.__doc__ = function.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: Any, owner: type | None = None) -> Value:
        if instance is None:
            return self  # type: ignore[return-value]
        value = self.function(instance)
        return vars(instance).setdefault(self.name, value)  # type: ignore[no-any-return]


class FieldsAlone:
    """A dataclass whose copies and pickles have the fields alone, and work out the rest again."""

    def __getstate__(self) -> dict[str, Any]:
        """What its fields hold; what `lazy` and `kept_on_argument` keep is none of it."""
        return {each.name: getattr(self, each.name) for each in fields(self)}  # type: ignore[arg-type]


class Latest:
    """Which objects have worked out a `lazy` property last: the others forget it, and begin anew.

    For what is large, soon made, and asked of one object after the other: as many have it as there
    are threads. Whoever holds it keeps it.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._lock = Lock()
        self._owners: list[ref[Any]] = []

    def add(self, owner: object) -> None:
        """Take notice that an object is about to have the property."""
        with self._lock:
            self._owners = [each for each in self._owners if each() not in (None, owner)]
            self._owners.append(ref(owner))
            gone, self._owners = self._owners[: -threads()], self._owners[-threads() :]
        for each in gone:
            if (old := each()) is not None:
                forget(old, self.name)


def forget(owner: object, name: str) -> None:
    """Let go of what a `lazy` property has worked out; it is worked out again when asked for."""
    vars(owner).pop(name, None)


def kept_on_argument(function: Callable[[Owner], Value]) -> Callable[[Owner], Value]:
    """A function of one object that is worked out once for each, and kept in the object itself.

    For what a room above derives from a view, such as its range image: `lazy` without a property.
    It lives as long as the object does; `dataclasses.replace` begins anew.
    """
    name = f"{function.__module__}.{function.__qualname__}"

    @wraps(function)
    def asked(owner: Owner) -> Value:
        kept = vars(owner)
        if name not in kept:
            kept.setdefault(name, function(owner))
        found: Value = kept[name]
        return found

    return asked
