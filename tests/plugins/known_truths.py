"""Truths of mechanisms that tests of a pytest process share: found once for each mechanism and times.

Tests of truths themselves share none.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest

from proofroll.core.last_results import LastResults
from proofroll.elements.mechanism import Mechanism
from proofroll.truth import truth_of_mechanism

# Largest number of truths that are kept, some hundred kB each.
_MOST = 300


def _content(value: Any) -> Hashable:
    """Content of a part of a mechanism, to the last bit; functions are themselves."""
    if is_dataclass(value):
        return type(value), *(_content(getattr(value, item.name)) for item in fields(value))
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    if isinstance(value, Mapping):
        return tuple((name, _content(item)) for name, item in value.items())
    if isinstance(value, tuple | list):
        return tuple(map(_content, value))
    return repr(value) if isinstance(value, float) else value  # type: ignore[no-any-return]  # a dict finds out


class KnownTruths:
    """Truths by mechanism and times."""

    def __init__(self) -> None:
        self._motions = LastResults[Hashable, Any](_MOST)

    @contextmanager
    def lent(self) -> Iterator[None]:
        """Context in which the truth's plug-in finds each truth once."""
        find = truth_of_mechanism.truth_of

        def known(mechanism: Mechanism, times: Any) -> Any:
            key = _content(mechanism), np.asarray(times, dtype=float).tobytes()
            return self._motions.of(key, lambda: find(mechanism, times))

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(truth_of_mechanism, "truth_of", known)
            yield
