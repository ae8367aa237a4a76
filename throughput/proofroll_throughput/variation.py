"""Variation of a scene: one parameter at some values, each a scene with a truth of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proofroll import InputError
from proofroll.studies.cases import scene_of_run

USUAL_VALUES, MOST_VALUES = 8, 16  # each has a truth of its own
MOST_COPIES = 1 << 20
_FORM = "write PARAMETER=LOW:HIGH, or with the number of values PARAMETER=LOW:HIGH:16"


@dataclass(frozen=True)
class Variation:
    """Values of one parameter of a scene.

    Attributes:
        parameter: its name.
        values: in SI units, from the lowest to the highest.
    """

    parameter: str
    values: tuple[float, ...]


def variation_of(text: str, scene: str, settings: Mapping[str, object]) -> Variation:
    """Variation that a person writes as ``angle=0.5:2.5`` or ``angle=30 deg:150 deg:16``.

    Args:
        text: as written.
        scene: name or path.
        settings: values of other parameters.

    Raises:
        InputError: the text has another form, the scene has no such parameter, or the range is none.
    """
    parameter, _, rest = text.partition("=")
    low, *others = rest.split(":")
    if not (parameter and low and len(others) in {1, 2} and all(others)):
        raise InputError("--vary", text, _FORM)
    if parameter in settings:
        raise InputError("--vary", text, f"--set gives {parameter} one value; leave it out there")
    count = _whole(others[1]) if others[1:] else USUAL_VALUES
    if count is None or not 2 <= count <= MOST_VALUES:
        raise InputError("--vary", text, f"give 2 to {MOST_VALUES} values: each has a truth of its own")
    ends = [scene_of_run(scene, {**settings, parameter: end}).parameters[parameter] for end in (low, others[0])]
    if not ends[0] < ends[1]:
        raise InputError("--vary", text, "the range is empty; write the lower end before the higher one")
    return Variation(parameter, tuple(np.linspace(ends[0], ends[1], count).tolist()))


def counts_of(text: str) -> list[int]:
    """Numbers of copies that a person writes as ``1,16,256``, sorted.

    Raises:
        InputError: one is no whole number from 1 on.
    """
    counts = {_whole(word) for word in text.split(",")}
    numbers = sorted(count for count in counts if count is not None and 1 <= count <= MOST_COPIES)
    if len(numbers) < len(counts):
        raise InputError("--copies", text, f"give whole numbers from 1 to {MOST_COPIES}, as 1,16,256")
    return numbers


def pattern_of(copies: int, values: int) -> list[int]:
    """Index of the value of each copy: neighbours differ, and each value has as many copies as another, or one more.

    Fewer copies than values are spread over them, one alone in the middle.
    """
    if copies >= values:
        return [number % values for number in range(copies)]
    return [(2 * number + 1) * values // (2 * copies) for number in range(copies)]


def _whole(text: str) -> int | None:
    """Whole number in a text; None: it is none."""
    return int(text) if text.strip().isdecimal() else None


def words(variation: Variation, values: Sequence[float] = ()) -> str:
    """Parameter and range for a reader, or the range of other ``values``."""
    shown = values or variation.values
    return f"{variation.parameter} {min(shown):g} to {max(shown):g}"
