"""Mistakes that explain a layer of a record together, where each alone leaves some of its columns wrong."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import Mistake, SearchTime, fitted
from proofroll.robots.control.record import LayerCause

Flags = NDArray[np.bool_]
_MOST = 3  # mistakes of one layer that are told


@dataclass(frozen=True)
class LayerTrials:
    """Trials of laws at one layer of a record.

    Attributes:
        parts: largest difference of each column in parts of its bar, under a law; NaN: it cannot be computed.
        left: all differences in parts of the sizes of their columns, row by row, under a law.
        fitting: further mistakes under a law, whose numbers fit what it leaves.
    """

    parts: Callable[[ControlLaw], Array]
    left: Callable[[ControlLaw], Array]
    fitting: Callable[[ControlLaw], Iterator[Mistake]]


@dataclass(frozen=True)
class _Told:
    """A mistake with a size, and the law with it."""

    mistake: Mistake
    size: float
    law: ControlLaw

    @property
    def numbers(self) -> int:
        """Number of fitted numbers."""
        return self.mistake.numbers + (self.mistake.sized and self.size not in {0.0, -1.0})


def mistakes_together(
    candidates: Sequence[Mistake], law: ControlLaw, trials: LayerTrials, time: SearchTime
) -> LayerCause | None:
    """Cause that names two or three mistakes with which every column holds; None where none are found.

    Each closes columns and leaves right ones right; what none closes alone is left to pairs, a mistake whose size is
    known and another one.
    """
    several = _one_by_one(candidates, law, trials, time) or _pair(candidates, law, trials, time)
    if not 1 < len(several) <= _MOST:
        return None
    residual = float(np.abs(trials.left(several[-1].law)).max(initial=0.0))
    sentence = "; and ".join(item.mistake.sentence(item.size) for item in several)
    return LayerCause(" + ".join(item.mistake.id for item in several), sentence, None, residual)


def may_close(candidates: Sequence[Mistake], law: ControlLaw, trials: LayerTrials, time: SearchTime) -> bool:
    """True if one mistake or more close every column."""
    return bool(_one_by_one(candidates, law, trials, time) or _pair(candidates, law, trials, time)) or time.over


def _one_by_one(
    candidates: Sequence[Mistake], law: ControlLaw, trials: LayerTrials, time: SearchTime
) -> Sequence[_Told]:
    """Mistakes with which every column holds, those first that close most; the last two may be a pair."""
    several: list[_Told] = []
    while (wrong := trials.parts(law) > 1).any() and len(several) < _MOST and not time.over:
        rest = [item for item in candidates if item.id not in {before.mistake.id for before in several}]
        changed = changed_columns(rest, law, trials.left, trials.left(law).reshape(-1, len(wrong)))
        near = [item for item in rest if np.any(changed[item.words] & wrong)]
        steps = [(closed, item) for item in _sized(near, law, trials) if (closed := _closed(item, trials, wrong))]
        more = [max(steps, key=lambda step: (step[0], -step[1].numbers))[1]] if steps else []
        if not more and several:
            more = _pair(rest, law, trials, time)
        if not more:
            return ()
        several, law = [*several, *more], more[-1].law
    return () if wrong.any() else several


def _closed(item: _Told, trials: LayerTrials, wrong: Flags) -> int:
    """Number of wrong columns that a mistake closes; 0 if it leaves a right one wrong, or cannot be computed."""
    parts = trials.parts(item.law)
    return int((wrong & (parts <= 1)).sum()) if np.all(parts[~wrong] <= 1) and np.isfinite(parts).all() else 0


def _pair(candidates: Sequence[Mistake], law: ControlLaw, trials: LayerTrials, time: SearchTime) -> list[_Told]:
    """Two mistakes that close every column, with the fewest fitted numbers; empty where none are found."""
    best: list[_Told] = []
    wrong = trials.parts(law) > 1
    changed = changed_columns(candidates, law, trials.left, trials.left(law).reshape(-1, len(wrong)))
    candidates = [item for item in candidates if np.any(changed[item.words] & wrong)]
    for first in _known(candidates, law):
        if not np.all(trials.parts(first.law)[~wrong] <= 1):
            continue
        beside = wrong & ~changed[first.mistake.words]
        others = [item for item in candidates if item.id != first.mistake.id and np.all(changed[item.words][beside])]
        for second in itertools.chain(_sized(others, first.law, trials), _fitting(first.law, trials)):
            if time.over:
                return best
            if np.all(trials.parts(second.law) <= 1) and (not best or second.numbers < best[1].numbers):
                best = [first, second]
    return best


def changed_columns(
    candidates: Sequence[Mistake], law: ControlLaw, left: Callable[[ControlLaw], Array], right: Array
) -> dict[str, Flags]:
    """Columns in which a mistake changes a row at a size from which its fit begins, by the words of each mistake.

    A column in which two change nothing stays wrong. ``left``: under a law; ``right``: without a mistake, by rows.
    """
    changed = {item.words: np.zeros(right.shape[1], bool) for item in candidates}
    for item in candidates:
        for size in item.starts if item.sized else (1.0,):
            trial = left(item.changed(law, size))
            changed[item.words] |= trial.size != right.size or np.any(trial.reshape(right.shape) != right, axis=0)
    return changed


def _known(candidates: Sequence[Mistake], law: ControlLaw) -> Iterator[_Told]:
    """Mistakes without a size to be fitted: those without one, and a size of 0 or -1 that has words of its own."""
    for item in candidates:
        sizes = [1.0] if not item.sized else [0.0] * bool(item.absent) + [-1.0] * bool(item.opposite)
        yield from (_Told(item, size, item.changed(law, size)) for size in sizes)


def _sized(candidates: Sequence[Mistake], law: ControlLaw, trials: LayerTrials) -> Iterator[_Told]:
    """Mistakes with known sizes, then with sizes that fit best what a law leaves."""
    yield from _known(candidates, law)
    for item in candidates:
        changed = partial(item.changed, law)
        for start in item.starts if item.sized else ():
            size = fitted(lambda size, changed=changed: trials.left(changed(size)), start)  # type: ignore[misc]
            yield _Told(item, size, changed(size))


def _fitting(law: ControlLaw, trials: LayerTrials) -> Iterator[_Told]:
    """Mistakes whose numbers fit what a law leaves."""
    yield from (_Told(item, 1.0, item.changed(law, 1.0)) for item in trials.fitting(law))
