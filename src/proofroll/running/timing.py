"""Timings that are comparable on a noisy machine: in rounds, with a confidence interval.

A disturbance slows all tasks of its round, so a ratio of two timings is taken round by round.
"""

import math
import os
import platform
import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

# Least confidence of an interval.
CONFIDENCE = 0.95
# Fewest rounds that give this confidence: the whole range of five values holds the median with 94 %.
ROUNDS = 6


@dataclass(frozen=True)
class Interval:
    """Median of measured values with a confidence interval.

    Attributes:
        value: the median.
        low, high: the two innermost measured values that have the confidence.
        confidence: probability that they enclose the true median: at least 0.95 from six values on; 0.75 for the range
            of three; 0 for a single value.
    """

    value: float
    low: float
    high: float
    confidence: float

    @property
    def known(self) -> bool:
        """True if the confidence is at least 95 %; otherwise there were too few values."""
        return self.confidence >= CONFIDENCE


@dataclass(frozen=True)
class Timing:
    """Values of repeated measurements.

    Attributes:
        values: one per round, in the order of the rounds [s].
        warmups: earlier values, which do not count [s].
    """

    values: tuple[float, ...]
    warmups: tuple[float, ...] = ()

    @cached_property
    def interval(self) -> Interval:
        """Median of the values with its interval [s]."""
        return _interval(np.array(self.values))


def time_in_rounds(
    tasks: Mapping[str, Callable[[], float | None]],
    rounds: int = ROUNDS,
    progress: Callable[[str], None] | None = None,
    once_above: float = np.inf,
    enough: Callable[[], bool] = lambda: False,
) -> dict[str, Timing]:
    """Timings of tasks, each run once per round in a random order; the first of several rounds is a warm-up.

    Args:
        tasks: name -> function that measures once and returns seconds, or None if that failed: the task is left out.
        rounds: number of rounds that count.
        progress: called with a task's name after each of its measurements.
        once_above: a task whose first value is larger [s] is not measured again; that value counts.
        enough: called after each round; True ends the measurement.
    """
    order = random.Random(0)
    seconds_of: dict[str, list[float]] = {name: [] for name in tasks}
    once: dict[str, Timing] = {}
    for _ in range(rounds + 1):
        names = [name for name in seconds_of if name not in once]
        order.shuffle(names)
        for name in names:
            seconds = tasks[name]()
            if progress:
                progress(name)
            if seconds is None:
                del seconds_of[name]
            else:
                seconds_of[name].append(seconds)
                if len(seconds_of[name]) == 1 and seconds > once_above:
                    once[name] = Timing((seconds,))
        if enough():
            break
    return {
        name: once.get(name) or (Timing(tuple(values[1:]), tuple(values[:1])) if values[1:] else Timing(tuple(values)))
        for name, values in seconds_of.items()
    }


def ratio(numerator: Timing, denominator: Timing) -> Interval:
    """Ratio of two timings, taken round by round; both must come from one call of :func:`time_in_rounds`."""
    return _interval(np.array(numerator.values) / np.array(denominator.values))


def interval_text(confidence: float) -> str:
    """Text for an interval with this confidence; one below 95 % is called a range."""
    if not confidence:
        return "measured once"
    return f"{'interval' if confidence >= CONFIDENCE else 'range'} of {100 * confidence:.3g} %"


def _interval(values: np.ndarray[Any, np.dtype[np.float64]]) -> Interval:
    """Narrowest pair of values, at equal ranks from both ends, that has the confidence; else the whole range.

    The number of values below the true median has a binomial distribution with p = 1/2, whatever that of the values.
    Source: H. A. David, H. N. Nagaraja, Order Statistics, 3rd ed., section 7.1.
    """
    ordered, count = np.sort(values), len(values)
    below = np.cumsum([math.comb(count, rank) for rank in range((count + 1) // 2)]) / 2.0**count
    rank = max((rank for rank, part in enumerate(below) if 1 - 2 * part >= CONFIDENCE), default=0)
    ends = float(ordered[rank]), float(ordered[count - 1 - rank])
    return Interval(float(np.median(values)), *ends, float(1 - 2 * below[rank]))


def machine() -> dict[str, str]:
    """Facts of the machine that affect speed."""
    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    }


def _processor() -> str:
    """Name of the processor, or the architecture if the system has no name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.processor() or platform.machine())
