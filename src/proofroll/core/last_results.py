"""Results of expensive functions that are kept: of a record with the record, of the last few states looked at."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, Generic, TypeVar

KeyT = TypeVar("KeyT", bound=Hashable)
ResultT = TypeVar("ResultT")


class LastResults(Generic[KeyT, ResultT]):
    """Results of the last different keys, at most ``most``; callers must not change them."""

    def __init__(self, most: int) -> None:
        self._results: OrderedDict[KeyT, ResultT] = OrderedDict()
        self._most = most

    def of(self, key: KeyT, function: Callable[[], ResultT]) -> ResultT:
        """Result of a key; ``function`` gives one that is not kept."""
        if key in self._results:
            self._results.move_to_end(key)
        else:
            self._results[key] = function()
            if len(self._results) > self._most:
                self._results.popitem(last=False)
        return self._results[key]


def kept(function: Callable[[Any], ResultT]) -> Callable[[Any], ResultT]:
    """Function of one record that never changes, called once for each record; callers must not change its result."""
    name = f"_{function.__module__}.{function.__qualname__}"

    @wraps(function)
    def once(record: Any) -> ResultT:
        results: dict[str, ResultT] = record.__dict__
        if name not in results:
            results[name] = function(record)
        return results[name]

    return once
