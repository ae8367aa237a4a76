"""Typical mistakes in a given trajectory, each named only if it closes the difference from the truth."""

import itertools
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES
from proofroll.core.diagnosis.vectors import best_clock_factor, best_delay, mistaken_rate
from proofroll.core.number_format import be, number, spaced

_DEGREE = np.pi / 180
# Unit -> factors by which numbers in another unit or sign differ, each with a clause and the unit of a length or angle
# that its columns then have, if `--map` can say so.
_SIGN = (-1.0, "the opposite of the truth: its sign?", "")
_ANGLES = (
    (1 / _DEGREE, "57.3 times the truth: degrees?", "deg"),
    (_DEGREE, "the truth over 57.3: radians, read as degrees?", ""),
    _SIGN,
)
_LENGTHS = (
    (1e3, "a thousand times the truth: millimetres?", "mm"),
    (1e2, "a hundred times the truth: centimetres?", "cm"),
    (1e-3, "a thousandth of the truth: metres, read as millimetres?", ""),
    _SIGN,
)
_FACTORS = {"rad": _ANGLES, "rad/s": _ANGLES, "m": _LENGTHS, "m/s": _LENGTHS}
_FEW = 5  # samples from which a fitted number proves something
# Part of a difference that a record at other times may leave: a pendulum whose push was left out leaves a fiftieth.
_AT_ANOTHER_TIME = 1e-2
# Delay, in intervals of samples, up to which it may be the error of a method of first order: half a step.
_OWN_ERROR = 0.75
_ROUND_OFF = 1e-12  # SI units, up to which a difference has no cause
_LIKE_ITS_TRUTH = 1e-3  # part of a variable's size up to which it needs no cause


@dataclass(frozen=True)
class GivenVariable:
    """Values of a given variable.

    Attributes:
        values, true: in the trajectory and in the truth at its times, shape (time, …).
        unit: of both.
    """

    values: FloatArray
    true: FloatArray
    unit: str

    @property
    def off(self) -> float:
        """Largest difference."""
        return float(np.max(np.abs(self.values - self.true), initial=0.0))

    @property
    def way(self) -> float:
        """Largest distance of the truth from its first row."""
        return float(np.max(np.abs(self.true - self.true[:1]), initial=0.0))

    @property
    def wrong(self) -> bool:
        """True if it differs by more than a small part of its size, and by more than round-off."""
        return self.off > max(_ROUND_OFF, _LIKE_ITS_TRUTH * float(np.max(np.abs(self.true), initial=0.0)))


def causes_of(variables: Mapping[str, GivenVariable], times: FloatArray, falling: Collection[str]) -> list[str]:
    """Clauses on the mistakes that explain variables of a trajectory, and on a first row that is not the start.

    Args:
        variables: of the trajectory and the truth, by name.
        times: of the samples [s].
        falling: names of the coordinates of bodies that nothing holds.
    """
    wrong = {name: item for name, item in variables.items() if item.wrong}
    sentences: dict[str, str] = {}
    for name, item in wrong.items():
        hypotheses = (*_scaled(item), *_combined(name, variables), *(_damped(item, times) if name in falling else ()))
        for says, values in hypotheses:
            left = float(np.max(np.abs(item.values - values), initial=0.0))
            size = float(np.max(np.abs(values), initial=0.0))  # a column of zeros is no part of the truth
            if left <= CLOSES * min(item.off, size) and name not in sentences:
                unit = spaced(item.unit)
                sentences[name] = (
                    f"{name} is {says} (off by {number(item.off)}{unit}, by {number(left, 1)}{unit} with that)"
                )
    for a, b in itertools.combinations(wrong, 2):
        if _exchanged(variables[a], variables[b]):
            sentences |= {a: f"{a} and {b} are each the other: swapped columns?", b: ""}
    open_ones = {name: item for name, item in wrong.items() if name not in sentences}
    if open_ones and (late := [*_late(variables, times)]):
        return late
    return [*filter(None, sentences.values()), *_first_row(open_ones, times)]


def begun_later(variables: Mapping[str, GivenVariable], from_start: Mapping[str, GivenVariable], begin: float) -> str:
    """Clause on a clock that does not begin with the motion; empty if that does not explain what differs.

    Args:
        variables: of the trajectory and the truth at its times, by name.
        from_start: the same with the truth at times that begin with 0.
        begin: time of the first row [s].
    """
    wrong = [name for name, item in variables.items() if item.wrong]
    closed = [
        name in from_start and (from_start[name].off <= CLOSES * item.off or not from_start[name].wrong)
        for name, item in variables.items()
        if name in from_start or item.wrong  # the truth has no number of others at the times from the start
    ]
    if not wrong or not all(closed):
        return ""
    name = max(wrong, key=lambda name: variables[name].off / (variables[name].way or 1.0))
    unit, off, left = spaced(variables[name].unit), number(variables[name].off), number(from_start[name].off, 1)
    return (
        f"the record is late by {begin:.4g} s (its clock begins then, with the scene's start: {name} {be(name)} off by "
        f"{off}{unit}, by {left}{unit} with that)"
    )


def mapping(cause: str, units: Mapping[str, str], columns: Mapping[str, str]) -> list[str]:
    """Names of columns that close a cause of another unit or of swapped columns, as ``theta=q.pivot[deg]``.

    Args:
        cause: one of the clauses of :func:`causes_of`.
        units: variable of the truth -> its unit.
        columns: of the trajectory -> variable of the truth, as they were named so far.
    """
    columns_of = {text.partition("[")[0]: column for column, text in columns.items()}
    name, _, says = cause.partition(" is ")
    unit = units.get(name, "")
    for _, words, length_or_angle in _FACTORS.get(unit, ()):
        if length_or_angle and says.startswith(words):
            per_time = "/s" if unit.endswith("/s") else ""
            return [f"{columns_of.get(name, name)}={name}[{length_or_angle}{per_time}]"]
    pair, swapped, _ = cause.partition(" are each the other")
    a, _, b = pair.partition(" and ")
    return [f"{columns_of.get(a, a)}={b}", f"{columns_of.get(b, b)}={a}"] if swapped else []


def _scaled(item: GivenVariable) -> Iterator[tuple[str, FloatArray]]:
    for factor, words, _ in _FACTORS.get(item.unit, (_SIGN,)):
        yield words, factor * item.true
    if item.unit == "rad":
        turns = np.round((item.true - item.values) / (2 * np.pi))
        yield "less by whole turns: wrapped to one turn?", item.true - 2 * np.pi * turns


def _combined(name: str, variables: Mapping[str, GivenVariable]) -> Iterator[tuple[str, FloatArray]]:
    """Sums and differences of angles: absolute where the scene's are relative, or the other way."""
    variable = variables[name]
    for other_name, item in variables.items():
        if other_name != name and item.unit == variable.unit == "rad":
            yield (
                f"its sum with {other_name}: an absolute angle, where the scene's is relative?",
                variable.true + item.true,
            )
            yield f"less by {other_name}: a relative angle, where the scene's is absolute?", variable.true - item.true


def _damped(item: GivenVariable, times: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """The fall with damping of the body's velocity by one rate, and late by one part of a step, both fitted."""
    if len(times) < _FEW:
        return
    way = item.true - item.true[0]
    steps = np.diff(times) * (way[1:] + way[:-1]) / 2
    lost, late = np.concatenate([[0.0], np.cumsum(steps)]), np.gradient(item.true, times)
    basis = np.stack([-lost, late], axis=1)
    rate, delay = np.linalg.lstsq(basis, item.values - item.true, rcond=None)[0]
    if rate > 0:
        says = f"slowed down: damping of {rate:.2g} 1/s of the velocity of a free body, which the scene has not?"
        yield says, item.true + basis @ [rate, delay]


def _late(variables: Mapping[str, GivenVariable], times: FloatArray) -> Iterator[str]:
    """Clause on the one delay or known rate of a clock that explains all variables that differ.

    Before a delay the motion stands at its start. Places tell both where they are given: velocities that jump, and
    quaternions of any sign, follow no curve.
    """
    places = {name: item for name, item in variables.items() if item.unit in {"m", "rad"}}
    variables = places if any(item.wrong for item in places.values()) else variables
    ways: dict[str, float] = {}
    for item in variables.values():
        ways[item.unit] = max(ways.get(item.unit, 0.0), item.way)
    moving = {name: item for name, item in variables.items() if item.way > _LIKE_ITS_TRUTH * ways[item.unit]}
    wrong = {
        name: item for name, item in variables.items() if item.wrong and item.off > _LIKE_ITS_TRUTH * ways[item.unit]
    }
    if not wrong or wrong.keys() - moving.keys():
        return
    values, true = (
        np.concatenate([(array / item.way).reshape(len(times), -1) for item, array in arrays], axis=1)
        for arrays in zip(*(((item, item.values), (item, item.true)) for item in wrong.values()), strict=True)
    )
    shift = best_delay(times, values, true, farthest=float(times[-1] - times[0]) / 2)
    if (
        shift is not None
        and shift[2] <= _AT_ANOTHER_TIME * shift[1]
        and abs(shift[0]) > _OWN_ERROR * float(np.min(np.diff(times)))
    ):
        delay, (off, left) = shift[0], (number(100 * part, 2) for part in shift[1:])
        which = "the record" if wrong.keys() == moving.keys() else " and ".join(wrong)
        verb, word = "is" if len(wrong) == 1 or which == "the record" else "are", "late" if delay > 0 else "early"
        yield f"{which} {verb} {word} by {abs(delay):.3g} s (off by {off} % of the way, by {left} % with that)"
        return
    paced = best_clock_factor(times, values, true) if wrong.keys() == moving.keys() else None
    # a pendulum of another length has another rate, but hardly one of these
    if paced is not None and mistaken_rate(paced[0]) and paced[2] <= _AT_ANOTHER_TIME * paced[1]:
        off, left = (number(100 * part, 2) for part in paced[1:])
        yield (
            f"the record runs {paced[0]:.3g} times as fast as its times say (off by {off} % of the way, by {left} % "
            "with that)"
        )


def _exchanged(variable_a: GivenVariable, variable_b: GivenVariable) -> bool:
    if variable_a.unit != variable_b.unit or variable_a.true.shape != variable_b.true.shape:
        return False
    left = max(
        float(np.max(np.abs(a.values - b.true), initial=0.0))
        for a, b in ((variable_a, variable_b), (variable_b, variable_a))
    )
    return left <= CLOSES * min(variable_a.off, variable_b.off)


def _first_row(wrong: Mapping[str, GivenVariable], times: FloatArray) -> Iterator[str]:
    """Clause on variables whose first row at time 0 is not the scene's start."""
    if not times.size or times[0] > 0:
        return
    apart = []
    for name, item in wrong.items():
        size = float(np.max(np.abs(item.true), initial=0.0)) or 1.0
        begun, start = (np.ravel(values[0]) for values in (item.values, item.true))
        if np.max(np.abs(begun - start)) > 10 * _LIKE_ITS_TRUTH * size:
            given_text, start_text = (", ".join(number(value, 4) for value in row) for row in (begun, start))
            apart.append(f"{name} {given_text} instead of {start_text}{spaced(item.unit)}")
    if apart:
        yield f"the first row is not the scene's start: {', '.join(apart)}"
