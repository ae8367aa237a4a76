"""Hypotheses of applied forces, bushings and rolling resistance with another law than the scene's."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Difference, Evidence, above_round_off, hypothesis
from proofroll.core.diagnosis.fitting import CauseRow, Residuals
from proofroll.core.diagnosis.samples import run_and_truth
from proofroll.elements.mechanism.diagnosis.equations import Change, is_motion, of_start, placed_of
from proofroll.elements.mechanism.diagnosis.pressing import Resisting
from proofroll.elements.mechanism.diagnosis.residuals import MOTION, by_rows
from proofroll.elements.mechanism.scene.bushing import Bushing, Six
from proofroll.elements.mechanism.scene.checks import WORLD, ZERO
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.parts import Axes, Force
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import Array, to_rpy
from proofroll.elements.mechanism.scene.signal import delayed, varies

_COVERS = (*MOTION, "drive")
_DEGREE = np.pi / 180
_DEPENDENT = 1e-6  # relative singular value of a direction along which a force may be moved without effect


@hypothesis(
    "prescribed motion",
    "at every sample, the coordinate of the joint is that of the changed motion, and not of the scene's; without a "
    "run, its acceleration at time 0",
)
def of_motions(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: one prescribed motion is a step late, has the wrong sign, or is in other units of angle."""
    mechanism, datasets = evidence.element.mechanism, run_and_truth(evidence)
    if not mechanism.prescribed:
        return
    placed = placed_of(mechanism, datasets[0]) if datasets is not None and is_motion(datasets[0]) else None
    start = of_start(evidence) if placed is None else None
    for joint, _, at_v in mechanism.prescribed:
        unit = joint.unit
        if placed is not None:
            # the sample at time 0 is given to an engine
            times, values = placed.time[1:], placed.along(joint)[0][1:, 0]
            what, units, part = f"coordinate of {joint.name}", unit, 0
        elif start is not None:
            times, values = np.zeros(1), start.v_rates[0][[at_v]]
            what, units, part = f"acceleration of {joint.name} at time 0", f"{unit}/s^2", 2
        else:
            return
        motion = _values(joint, 1.0, 0.0, times)[part]
        difference = float(np.max(np.abs(values - motion), initial=0.0))
        if not above_round_off(difference, float(np.max(np.abs(motion), initial=0.0))):
            continue
        for says, factor, delay, remedy in _mistakes(joint, evidence.step):
            remainder = float(np.max(np.abs(values - _values(joint, factor, delay, times)[part])))
            name = f"motion of {joint.name}"
            yield Difference(what, units, difference, _COVERS).cause(name, f"the {name} {says}", remainder, remedy)


def _values(joint: Joint, factor: float, delay: float, times: FloatArray) -> FloatArray:
    """Places, rates and accelerations of a motion with a factor and a delay [s], (3, times)."""
    assert joint.motion is not None  # as of all prescribed ones
    parts = moved(delayed(joint.motion, delay), times)
    return np.array([factor * np.broadcast_to(part, times.shape) for part in parts])


def _mistakes(joint: Joint, step: float | None) -> Iterator[tuple[str, float, float, str]]:
    """Words, factor, delay [s] and remedy of each mistake."""
    if step and joint.motion is not None and varies(joint.motion):
        yield "is a step late", 1.0, step, "evaluate it at the time of each stage of the step"
    yield "has the opposite sign", -1.0, 0.0, "it is along the joint's axis, of the child from the parent"
    if joint.kind == JointKind.REVOLUTE:
        yield "is taken for degrees", _DEGREE, 0.0, "the scene's motion is in radians"
        yield "is in degrees", 1 / _DEGREE, 0.0, "the scene's motion is in radians"


PartT = TypeVar("PartT", Force, Bushing)
_PROOF = "the equations of motion balance at every state of the run with that law, and not with the scene's"
# Axes of a bushing in another order: words, numbers of the axes whose values they take.
_ORDERS = (
    ("exchanges x and y", (1, 0, 2)),
    ("exchanges y and z", (0, 2, 1)),
    ("exchanges z and x", (2, 1, 0)),
    ("shifts x to y, y to z, z to x", (2, 0, 1)),
    ("shifts x to z, z to y, y to x", (1, 2, 0)),
)
_REMEDY = "the moment is an arm, in metres, times the normal force of that moment, against what the scene says"
_LAWS = (
    # of a scene's law against motion alone
    (Resisting(turning=True), "the rolling resistance is against turning where the ball slips, not against its motion"),
    (
        Resisting(along_spin=True),
        "the rolling resistance acts against the whole angular velocity, spin about the normal included",
    ),
    (Resisting(by_weight=True), "the rolling resistance is its arm times the weight, not times the normal force"),
)


def _with(mechanism: Mechanism, table: str, number: int, part: Force | Bushing) -> Mechanism:
    """Mechanism with another part of its ``forces`` or ``bushings``."""
    parts = getattr(mechanism, table)
    changed: dict[str, Any] = {table: (*parts[:number], part, *parts[number + 1 :])}
    return replace(mechanism, **changed)


def _exchanged(
    mechanism: Mechanism, table: str, mistakes: Callable[[PartT], Iterator[tuple[str, PartT, str]]]
) -> Iterator[CauseRow[Change]]:
    """Rows: one of the parts of a table has one of its mistakes: words, other part, remedy."""
    for number, part in enumerate(getattr(mechanism, table)):
        for says, other_part, remedy in mistakes(part):
            name = f"{table.removesuffix('s')} {part.name}"
            kind = getattr(part, "kind", "bushing")
            yield CauseRow(
                name, f"{kind} {part.name} {says}", Change(_with(mechanism, table, number, other_part)), remedy
            )


@by_rows("bushing", _PROOF)
def of_bushings(evidence: Evidence, _: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: one bushing with its axes in another order, along those of a body, or without its dampers."""
    return _exchanged(evidence.element.mechanism, "bushings", _of_bushing)


def _of_bushing(bushing: Bushing) -> Iterator[tuple[str, Bushing, str]]:
    """Words, changed bushing and remedy of each mistake that would change this bushing."""
    for says, order in _ORDERS:
        stiffness, damping = _ordered(bushing.stiffness, order), _ordered(bushing.damping, order)
        if (stiffness, damping) != (bushing.stiffness, bushing.damping):
            remedy = "give each axis of its frame its stiffness and damping, along and then about it"
            yield says, replace(bushing, stiffness=stiffness, damping=damping), remedy
    translation, rotation = bushing.stiffness[:3], bushing.stiffness[3:]
    if any(bushing.orientation_a):
        # B turns with A, or the bushing would be loaded at rest
        along_body = replace(bushing, orientation_a=ZERO, orientation_b=_less(bushing))
        says = f"acts along the axes of {bushing.body_a}, not of its frame there"
        yield says, along_body, f"turn its frame by its orientation in {bushing.body_a}"
    if any(rotation) and any(translation):
        without = replace(bushing, stiffness=(*translation, 0.0, 0.0, 0.0))
        yield "has no stiffness about axes", without, "give it all six values"
    if any(bushing.damping):
        yield "has no damping", replace(bushing, damping=(0.0,) * 6), "give it its six values of damping"


def _ordered(values: Six, order: tuple[int, int, int]) -> Six:
    x, y, z = order
    return (values[x], values[y], values[z], values[3 + x], values[3 + y], values[3 + z])


def _less(bushing: Bushing) -> tuple[float, float, float]:
    """Orientation of B that keeps B at rest where A has the axes of body_a."""
    return to_rpy(bushing.frame_b @ bushing.frame_a.T)


@by_rows("applied force", _PROOF)
def of_applied_forces(evidence: Evidence, residuals: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: one applied force with a factor, in other axes, at another place, without reaction, or late."""
    mechanism: Mechanism = evidence.element.mechanism
    yield from _exchanged(mechanism, "forces", lambda force: _of_force(mechanism, force, evidence.step))
    for number, force in enumerate(mechanism.forces):

        def scaled(x: float, number: int = number) -> Change:
            return Change(mechanism, factors_of_forces=((number, x),))

        says = f"the engine moves it with the {force.kind} {force.name}"
        remedy = f"give {force.name} its value, on {force.body}"
        yield from residuals.scaled(f"size of {force.name}", says, scaled, remedy)
        if force.kind == "force":
            yield _elsewhere(residuals, mechanism, number, evidence.element.length)


def _elsewhere(residuals: Residuals[Change], mechanism: Mechanism, number: int, length: float) -> CauseRow[Change]:
    """Row: the force acts along another line, through its nearest place that balances the equations."""
    force = mechanism.forces[number]

    def moved(shift: Array) -> Change:
        x, y, z = (force.position + shift).tolist()
        return Change(_with(mechanism, "forces", number, replace(force, position=(x, y, z))))

    shift = residuals.numbers_of(moved, 3, _DEPENDENT)
    place = np.where(np.abs(force.position + shift) < 1e-6 * length, 0.0, force.position + shift)
    words = ", ".join(f"{x:.3g}" for x in place)
    says = f"force {force.name} acts along a line through ({words}) m of {force.body}, not through its place"
    remedy = f"give its place in the axes of {force.body}, from the origin of its frame"
    model, change = moved(place - force.position), float(np.linalg.norm(shift)) / length
    return CauseRow(f"place of {force.name}", says, model, remedy, fitted=3, change=change)


def _of_force(mechanism: Mechanism, force: Force, step: float | None) -> Iterator[tuple[str, Force, str]]:
    """Words, changed force and remedy of each mistake that would change this force."""
    frame: Axes = "world" if force.frame == "body" else "body"
    axes = {"world": "of the world", "body": f"of {force.body}"}
    says = f"acts along the axes {axes[frame]}, not {axes[force.frame]}"
    yield says, replace(force, frame=frame), "look at whose axes its components are along"
    if force.kind == "force":
        com = next(body.com for body in mechanism.bodies if body.name == force.body)
        x, y, z = force.position
        mirrored = (-x, -y, -z)
        for place, words in ((com, "the centre of mass"), (ZERO, "the origin"), (mirrored, "the opposite place")):
            if place != force.position:
                says = f"acts at {words} of {force.body}, not at its place"
                yield says, replace(force, position=place), "add the moment of the force about the centre of mass"
    if force.reaction != WORLD:
        says = f"has no reaction on {force.reaction}"
        yield says, replace(force, reaction=WORLD), f"apply the opposite to {force.reaction} at the same place"
    if step and any(map(varies, force.value)):
        late = replace(force, value=tuple(delayed(part, step) for part in force.value))  # type: ignore[arg-type]  # three
        yield "is a step late", late, "evaluate it at the time of each stage of the step"


@by_rows("rolling resistance", _PROOF)
def rolling_resistance(evidence: Evidence, residuals: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: rolling resistance has a factor, is against the whole spin, or is by the weight."""
    mechanism, name = evidence.element.mechanism, "rolling resistance"
    if not any(contact.rolling_resistance for contact in mechanism.contacts):
        return
    moves = any(contact.bend for contact in mechanism.contacts)
    for law, says in _LAWS if moves else _LAWS[1:]:
        yield CauseRow(name, says, Change(mechanism, resisting=law), _REMEDY)
    says = "the engine moves it with rolling resistance"

    def changed(factor: float) -> Change:
        return Change(mechanism, resisting=Resisting(factor))

    yield from residuals.scaled(name, says, changed, _REMEDY, signed=False, linear=False)
