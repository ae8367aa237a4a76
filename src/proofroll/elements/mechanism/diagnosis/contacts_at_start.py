"""Hypotheses on contacts at time 0, tested by the first accelerations."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES, Cause, Evidence, hypothesis
from proofroll.core.diagnosis.fitting import (
    change_by,
    factor_text,
    least_squares_parameter,
    least_squares_parameters,
    possible,
)
from proofroll.core.errors import Refused
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.elements.mechanism.checks import WORLD
from proofroll.elements.mechanism.contacts.geometry import Geometry
from proofroll.elements.mechanism.contacts.observables import follow_contacts
from proofroll.elements.mechanism.contacts.start import TOUCHING
from proofroll.elements.mechanism.diagnosis.contacts import FORCE, contact_cause
from proofroll.elements.mechanism.diagnosis.equations import of_start
from proofroll.elements.mechanism.rotations import frame_of_axis

_PLACED = 1e-3  # part of the difference that a wrong place may leave: of three numbers two are fitted
_NOWHERE = 1e-8  # largest coordinate that counts as zero, relative to the mechanism's length


@hypothesis(
    "contacts at time 0", "the accelerations at time 0 are those of a mechanism whose contacts differ in one thing"
)
def at_start(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses on the first accelerations: a pair missing, friction scaled, off or swapped, a geometry moved."""
    element, start = evidence.element, None
    if element.mechanism.contacts:
        start = of_start(evidence, derived=True)
    if start is None:
        return
    mechanism, size = element.mechanism, element.length
    found = start.each[0].acceleration * np.array([1, 1, 1, size, size, size])

    def apart(pairs: Sequence[Any], geometries: Sequence[Any] = mechanism.geometries) -> FloatArray:
        try:
            first = type(element)(replace(mechanism, pairs=tuple(pairs), geometries=tuple(geometries))).first_motion
        except Refused:
            return np.full(1, np.inf)
        return np.ravel(np.concatenate([first.acceleration, size * first.angular_acceleration], axis=-1) - found)

    def off(pairs: Sequence[Any]) -> float:
        return float(np.abs(apart(pairs)).max())

    pairs = mechanism.pairs
    before = off(pairs)

    # beyond the allowance of a line nothing is the error of a step, however near to the scene's
    wrong = [line for line in evidence.lines if OF_FIRST_STEPS in str(line["quantity"]) and not line["holds"]]

    def cause(
        says: str, after: float, remedy: str, number: int = 0, change: float = np.inf, closes: float = CLOSES
    ) -> Cause:
        proof = "contacts at time 0", says, "acceleration at time 0", "m/s^2", before, after, remedy, number
        return contact_cause(*proof, explains=found.size, change=np.inf if wrong else change, closes=closes)

    def scaled(factor: float, which: Sequence[Any] = pairs) -> list[Any]:
        return [replace(pair, friction=max(factor, 0.0) * pair.friction) if pair in which else pair for pair in pairs]

    if not before > FORCE * element.first_motion.scale:
        return
    own = "give each pair its own coefficient"
    for pair in pairs:
        if len(pairs) > 1:
            left = off([other for other in pairs if other is not pair])
            yield cause(f"the contact {pair.name} is left out", left, "let the pair touch")
    yield cause("friction of all contacts is off", off(scaled(0.0)), own)
    for a, b in itertools.combinations(pairs, 2):
        if a.friction != b.friction:
            swap = {a.name: b.friction, b.name: a.friction}
            after = off([replace(pair, friction=swap.get(pair.name, pair.friction)) for pair in pairs])
            yield cause(f"friction of {a.name} and {b.name} is swapped", after, own)
    from scipy.optimize import minimize_scalar  # half a second, which few runs need

    fit = minimize_scalar(
        lambda factor: off(scaled(factor)), bounds=(0.0, 3.0), method="bounded", options={"xatol": 1e-6}
    )
    groups: list[tuple[str, Sequence[Any], float]] = [("all contacts", pairs, float(fit.x))]
    for pair in pairs if len(pairs) > 1 else ():

        def changed(factor: float, pair: Any = pair) -> FloatArray:
            return apart(scaled(factor, (pair,)))

        groups.append((pair.name, (pair,), least_squares_parameter(changed, 1.0, 1.0)))
    for name, which, factor in groups:
        after = off(scaled(factor, which)) if possible(factor, signed=False) else np.inf
        yield cause(f"friction of {name} is {factor_text(factor)}", after, own, 1, change_by(factor))
    for number, across in _on_planes(element):

        def moved(way: FloatArray, k: int = number, across: FloatArray = across) -> list[Geometry]:
            others = list(mechanism.geometries)
            x, y, z = (np.array(others[k].position) + across @ way).tolist()
            others[k] = replace(others[k], position=(x, y, z))
            return others

        def with_moved(way: FloatArray, moved: Callable[[FloatArray], list[Geometry]] = moved) -> FloatArray:
            return apart(pairs, moved(way))

        way = least_squares_parameters(with_moved, np.zeros(2), size)
        geometry, after = moved(way)[number], float(np.abs(with_moved(way)).max())
        at = ", ".join(
            f"{x:.5g}" for x in np.where(np.abs(geometry.position) > _NOWHERE * size, geometry.position, 0.0)
        )
        says, off_by = f"the geometry {geometry.name} is at ({at}) m", float(np.linalg.norm(way)) / size
        yield cause(says, after, "look at the places of geometries", 2, off_by, _PLACED)


def _on_planes(element: Any) -> Iterator[tuple[int, FloatArray]]:
    """Numbers of the geometries that touch a plane at the start, each with two directions along it, (3, 2)."""
    mechanism, found = element.mechanism, follow_contacts(element.start)
    closed = {
        contact.name: found.normal[0, k]
        for k, contact in enumerate(mechanism.contacts)
        if abs(found.gap[0, k]) <= TOUCHING * element.length
    }
    numbers = {geometry.name: number for number, geometry in enumerate(mechanism.geometries)}
    for pair in mechanism.pairs:
        one, other = sorted(
            (mechanism.geometries[numbers[name]] for name in pair.geometries), key=lambda g: g.kind == "plane"
        )
        if pair.name in closed and other.kind == "plane" and one.body != WORLD:
            R = element.start.R_WB[0, mechanism.body_index[one.body]]
            yield numbers[one.name], frame_of_axis(R.T @ closed[pair.name])[:, :2]
