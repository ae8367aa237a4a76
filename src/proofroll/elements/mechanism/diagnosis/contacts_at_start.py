"""Hypotheses on contacts at time 0, tested by the first accelerations."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray, longest
from proofroll.core.diagnosis import CLOSES, CLOSES_EXACTLY, Cause, Difference, Evidence, hypothesis
from proofroll.core.diagnosis.fitting import change_by, factor_text, least_squares_parameter, least_squares_parameters
from proofroll.core.errors import Refused
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.elements.mechanism.contact.start import TOUCHING
from proofroll.elements.mechanism.diagnosis.contacts import FORCE
from proofroll.elements.mechanism.diagnosis.equations import of_start
from proofroll.elements.mechanism.diagnosis.residuals import TOUCHING_MOTION
from proofroll.elements.mechanism.run.contacts.observables import follow_contacts
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.checks import WORLD
from proofroll.elements.mechanism.scene.rotations import frame_of_axis
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry

_PLACED = 1e-3  # part of the difference that a wrong place may leave: of three numbers two are fitted
_OWN = "give each pair its own coefficient"
_TURNING = {"rolling_resistance": "rolling resistance", "spinning_friction": "friction against spin"}
_NOWHERE = 1e-8  # largest coordinate that counts as zero, relative to the mechanism's length


def _longest(apart: FloatArray) -> float:
    """Longest vector of some accelerations in one row [m/s²]; infinite if they are."""
    return longest(apart.reshape(-1, 3)) if apart.size % 3 == 0 else float(np.abs(apart).max())


class _FirstAccelerations:
    """First accelerations of a run, against those of its mechanism with other pairs and geometries."""

    def __init__(self, evidence: Evidence, accelerations: FloatArray) -> None:
        self.element, self.mechanism = evidence.element, evidence.element.mechanism
        self.pairs: Sequence[Any] = self.mechanism.pairs
        self._found = accelerations * np.array([1.0, 1.0, 1.0, *[self.element.length] * 3])
        # beyond the allowance of a line nothing is the error of a step, however near to the scene's
        lines = [line for line in evidence.lines if OF_FIRST_STEPS in str(line["quantity"])]
        self._wrong = any(not line["holds"] for line in lines)
        self.before = self.off(self.pairs)
        # what the steps from which the accelerations come, and round-off, leave of a right cause
        motion, allowed = self.element.first_motion, max((float(line["tolerance"]) for line in lines), default=0.0)
        size = max(motion.scale, self.element.length * longest(motion.angular_acceleration))
        self._left = max(allowed * size, CLOSES_EXACTLY * self.before)

    def apart(self, pairs: Sequence[Any], geometries: Sequence[Any] | None = None) -> FloatArray:
        """Accelerations [m/s²] of a mechanism with these contacts minus those of the run; inf if it is refused."""
        parts = {"pairs": tuple(pairs), "geometries": tuple(geometries or self.mechanism.geometries)}
        try:
            motion = MechanismElement(replace(self.mechanism, **parts)).first_motion
        except Refused:
            return np.full(1, np.inf)
        turning = self.element.length * motion.angular_acceleration
        return np.ravel(np.concatenate([motion.acceleration, turning], axis=-1) - self._found)

    def off(self, pairs: Sequence[Any]) -> float:
        """Longest vector of :meth:`apart`."""
        return _longest(self.apart(pairs))

    def scaled(self, factor: float, which: Sequence[Any]) -> list[Any]:
        """All pairs, some of them with a factor on their friction."""
        factor = max(factor, 0.0)
        return [
            pair.with_friction(factor * pair.friction if factor else 0.0) if pair in which else pair
            for pair in self.pairs
        ]

    def cause(
        self, says: str, remainder: float, remedy: str, number: int = 0, change: float = np.inf, closes: float = CLOSES
    ) -> Cause:
        """Cause that leaves ``remainder`` of the accelerations, with ``number`` fitted values.

        It may leave no more than the steps and round-off do: a fitted number takes away a part of any difference.
        """
        closes = min(closes, self._left / self.before)
        off = Difference("acceleration at time 0", "m/s^2", self.before, TOUCHING_MOTION, closes=closes)
        change, explains = np.inf if self._wrong else change, self._found.size
        return off.cause("contacts at time 0", says, remainder, remedy, number, explains=explains, change=change)


@hypothesis(
    "contacts at time 0", "the accelerations at time 0 are those of a mechanism whose contacts differ in one thing"
)
def at_start(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses on the first accelerations: a pair missing, friction scaled, off or swapped, a geometry moved."""
    start = of_start(evidence, derived=True) if evidence.element.mechanism.contacts else None
    if start is not None:
        accelerations = _FirstAccelerations(evidence, start.each[0].acceleration)
        if accelerations.before > FORCE * accelerations.element.first_motion.scale:
            for causes in (_other_pairs, _other_friction, _other_turning, _other_places):
                yield from causes(accelerations)


def _other_pairs(accelerations: _FirstAccelerations) -> Iterator[Cause]:
    """Causes: a pair is left out, friction is off, or that of two pairs is swapped."""
    for pair in accelerations.pairs if len(accelerations.pairs) > 1 else ():
        left = accelerations.off([rival for rival in accelerations.pairs if rival is not pair])
        yield accelerations.cause(f"the contact {pair.name} is left out", left, "let the pair touch")
    yield accelerations.cause(
        "friction of all contacts is off", accelerations.off(accelerations.scaled(0.0, accelerations.pairs)), _OWN
    )
    for a, b in itertools.combinations(accelerations.pairs, 2):
        if a.friction != b.friction:
            laws = {a.name: b, b.name: a}
            swapped = [laws.get(pair.name, pair) for pair in accelerations.pairs]
            remainder = accelerations.off(
                [
                    replace(pair, friction=law.friction, static_friction=law.static_friction)
                    for pair, law in zip(accelerations.pairs, swapped, strict=True)
                ]
            )
            yield accelerations.cause(f"friction of {a.name} and {b.name} is swapped", remainder, _OWN)


def _other_turning(accelerations: _FirstAccelerations) -> Iterator[Cause]:
    """Causes: a pair slips with its static friction, or friction against rolling or spin is off or has a factor."""
    for pair in accelerations.pairs:
        if pair.static != pair.friction:
            remainder = accelerations.off(
                [_with(item, pair, friction=pair.static, static_friction=None) for item in accelerations.pairs]
            )
            yield accelerations.cause(
                f"{pair.name} slips with its static friction", remainder, "take the kinetic one in a slip"
            )
        for key, name in _TURNING.items():
            size = getattr(pair, key)
            if not size or pair.cone == "shared":
                continue

            def changed(factor: float, pair: Any = pair, key: str = key, size: float = size) -> FloatArray:
                value = max(factor, 0.0) * size
                return accelerations.apart([_with(item, pair, **{key: value}) for item in accelerations.pairs])

            yield accelerations.cause(f"{name} of {pair.name} is off", _longest(changed(0.0)), _OWN)
            factor = max(least_squares_parameter(changed, 1.0, 1.0), 0.0)
            says = f"{name} of {pair.name} is {factor_text(factor)}"
            yield accelerations.cause(says, _longest(changed(factor)), _OWN, 1, change_by(factor))


def _with(pair: Any, chosen: Any, **laws: float | None) -> Any:
    """The pair, or if it is the ``chosen`` one, with other laws."""
    return replace(pair, **laws) if pair is chosen else pair


def _other_friction(accelerations: _FirstAccelerations) -> Iterator[Cause]:
    """Causes: a factor on the friction of all pairs, or of one."""
    from scipy.optimize import minimize_scalar  # half a second, which few runs need

    def of_all(factor: float) -> float:
        return accelerations.off(accelerations.scaled(factor, accelerations.pairs))

    fit = minimize_scalar(of_all, bounds=(0.0, 3.0), method="bounded", options={"xatol": 1e-6})
    groups: list[tuple[str, Sequence[Any], float]] = [("all contacts", accelerations.pairs, float(fit.x))]
    for pair in accelerations.pairs if len(accelerations.pairs) > 1 else ():

        def changed(factor: float, pair: Any = pair) -> FloatArray:
            return accelerations.apart(accelerations.scaled(factor, (pair,)))

        # below 0, where the fit may end, friction is off
        groups.append((pair.name, (pair,), max(least_squares_parameter(changed, 1.0, 1.0), 0.0)))
    for name, which, factor in groups:
        remainder = accelerations.off(accelerations.scaled(factor, which))
        yield accelerations.cause(f"friction of {name} is {factor_text(factor)}", remainder, _OWN, 1, change_by(factor))


def _other_places(accelerations: _FirstAccelerations) -> Iterator[Cause]:
    """Causes: a geometry lies at another place of the plane that it touches."""
    size = accelerations.element.length
    for number, across in _on_planes(accelerations.element):

        def moved(way: FloatArray, k: int = number, across: FloatArray = across) -> list[Geometry]:
            others = list(accelerations.mechanism.geometries)
            x, y, z = (np.array(others[k].position) + across @ way).tolist()
            others[k] = replace(others[k], position=(x, y, z))
            return others

        def with_moved(way: FloatArray, moved: Callable[[FloatArray], list[Geometry]] = moved) -> FloatArray:
            return accelerations.apart(accelerations.pairs, moved(way))

        way = least_squares_parameters(with_moved, np.zeros(2), size)
        geometry, remainder = moved(way)[number], _longest(with_moved(way))
        shown = np.where(np.abs(geometry.position) > _NOWHERE * size, geometry.position, 0.0)
        says = f"the geometry {geometry.name} is at ({', '.join(f'{x:.5g}' for x in shown)}) m"
        off_by = float(np.linalg.norm(way)) / size
        yield accelerations.cause(says, remainder, "look at the places of geometries", 2, off_by, _PLACED)


def _on_planes(element: Any) -> Iterator[tuple[int, FloatArray]]:
    """Numbers of the geometries that touch a plane at the start, each with two directions along it, (3, 2)."""
    mechanism, followed = element.mechanism, follow_contacts(element.start)
    closed = {
        contact.name: followed.normal[0, k]
        for k, contact in enumerate(mechanism.contacts)
        if abs(followed.gap[0, k]) <= TOUCHING * element.length
    }
    numbers = {geometry.name: number for number, geometry in enumerate(mechanism.geometries)}
    for pair in mechanism.pairs:
        way_1, way_2 = sorted(
            (mechanism.geometries[numbers[name]] for name in pair.geometries), key=lambda g: g.kind == "plane"
        )
        if pair.name in closed and way_2.kind == "plane" and way_1.body != WORLD:
            R = element.start.R_WB[0, mechanism.body_index[way_1.body]]
            yield numbers[way_1.name], frame_of_axis(R.T @ closed[pair.name])[:, :2]
