"""Properties that are worked out once, when they are first asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

Value = TypeVar("Value")


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
