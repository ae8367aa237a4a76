"""Cache of compiled functions and integrators (heyoka, an extra): equal expressions are compiled once."""

from collections import OrderedDict
from collections.abc import Sequence
from threading import get_ident
from typing import Any, NamedTuple

import numpy as np

try:
    import heyoka
except ImportError:  # no wheel for this platform
    heyoka = None

__all__ = ["CompiledExpressions", "compiled_once", "heyoka"]


class CompiledExpressions(NamedTuple):
    """Function of all values of a mode, and integrator of its rates, which are the last."""

    values: Any
    integrator: Any


_MODES: OrderedDict[tuple[int, ...], CompiledExpressions] = OrderedDict()
_MOST_MODES = 128  # compiled modes that are kept


def compiled_once(expressions: Sequence[Any], state: Sequence[Any], by_collocation: bool) -> CompiledExpressions:
    """Compiled expressions of a mode; the same for scenes that differ in numbers alone, in one thread.

    They are recognised by hashes: to compare expressions takes for ever where they share parts. Optimised code takes
    two to ten times as long to compile, which no run earns back.
    """
    key = (get_ident(), by_collocation, len(state), *map(hash, expressions))
    if key not in _MODES:
        values = heyoka.cfunc(expressions, state, compact_mode=True, opt_level=0)
        integrator = None
        if not by_collocation:
            system, start = list(zip(state, expressions[-len(state) :], strict=True)), np.zeros(len(state))
            integrator = heyoka.taylor_adaptive(system, start, compact_mode=True, opt_level=0)
        _MODES[key] = CompiledExpressions(values, integrator)
        if len(_MODES) > _MOST_MODES:
            _MODES.popitem(last=False)
    _MODES.move_to_end(key)
    return _MODES[key]
