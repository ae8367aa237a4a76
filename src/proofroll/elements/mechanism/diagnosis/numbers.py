"""Rows of wrong numbers, of all bodies, joints or springs or of one of them, and of other laws of single parts."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Difference, Evidence, above_round_off, hypothesis
from proofroll.core.diagnosis.fitting import CauseRow, Residuals, factor_text, possible
from proofroll.core.diagnosis.samples import run_and_truth
from proofroll.elements.mechanism.diagnosis.equations import Change, is_motion, of_start, placed_of
from proofroll.elements.mechanism.diagnosis.pressing import Resisting
from proofroll.elements.mechanism.diagnosis.residuals import MOTION, by_rows
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.linear_balance import steiner
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
_ONE_FACTOR = "the equations of motion are linear in it: one factor balances them at every state of the run"
_UNSIGNED = {"mass", "inertia", "armature"}  # numbers that no engine has with the wrong sign
_OF_DAMPING = "their damping, as a moment per rad/s or a force per m/s against the motion"
# Laws of joints: key, id of the row, words, and what an author gives the joints.
_OF_JOINTS = (
    ("damping", "joint damping", "damping", _OF_DAMPING),
    ("friction", "joint friction", "dry friction", "their dry friction, against the motion"),
    ("stiffness", "joint stiffness", "stiffness", "their stiffness, per rad or per m"),
    ("torque", "joint torque", "drives", "their drive, on the child against the parent"),
    ("armature", "armature", "armature", "their armature"),
)


@by_rows("numbers of all", _ONE_FACTOR)
def factors_of_all(evidence: Evidence, residuals: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: the engine moves all bodies, joints or springs with one factor on a number."""
    mechanism: Mechanism = evidence.element.mechanism
    mass, _, inertia = _of_bodies(mechanism)
    model = partial(Change, mechanism)

    def of_all(name: str, what: str, model: Any, remedy: str, quantity: str = "") -> Iterator[CauseRow[Change]]:
        signed = name not in _UNSIGNED
        return residuals.scaled(name, f"the engine moves it with {what}", model, remedy, quantity, signed=signed)

    if any(mechanism.gravity):
        remedy = "give the engine the scene's gravity: an acceleration in the world, its sign and its unit"
        g = np.array(mechanism.gravity)
        yield from of_all("gravity", "gravity", lambda x: model(gravity=x * g), remedy, "gravity")
    if mechanism.bodies:
        remedy = "give each body its {} once"
        yield from of_all("mass", "all masses", lambda x: model(mass=x * mass), remedy.format("mass"), "mass")
        of_inertia = remedy.format("inertia")
        yield from of_all("inertia", "all inertias", lambda x: model(inertia=x * inertia), of_inertia, "inertia")
    for law, name, words, give in _OF_JOINTS:
        if any(getattr(joint, law) for joint in mechanism.joints):
            what, remedy = f"the {words} of the joints", f"give the joints {give}"
            yield from of_all(name, what, lambda x, law=law: model(**{law: x}), remedy)
    if mechanism.springs:
        remedy = "give the springs their stiffness and free length"
        yield from of_all("springs", "the stiffness of the springs", lambda x: model(springs=x), remedy)
    if any(spring.damping for spring in mechanism.springs):
        what, remedy = "the damping of the springs", "give the springs their damping, along the line between their ends"
        yield from of_all("damping of springs", what, lambda x: model(spring_damping=x), remedy)
        remedy = "give the springs their stiffness, damping and free length"
        yield from of_all("springs with damping", "the springs", lambda x: model(springs=x, spring_damping=x), remedy)
    if mechanism.bushings:
        remedy = "give the bushings their stiffness and damping"
        yield from of_all("bushings", "the bushings", lambda x: model(bushings=x), remedy)
    if mechanism.bodies:
        what, remedy = "the gyroscopic moments w x I w", "the rate of the angular momentum has the term w x I w"
        yield from of_all("gyroscopic terms", what, lambda x: model(gyroscopic=x), remedy)


def _of_bodies(mechanism: Mechanism) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Masses, centres of mass and inertias of the bodies."""
    mass, com, inertia = (np.array([getattr(b, key) for b in mechanism.bodies]) for key in ("mass", "com", "inertia"))
    return mass, com, inertia


@by_rows("body", "one body has another mass or inertia, or its inertia about other axes or another point")
def of_each_body(evidence: Evidence, residuals: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows of one body: a factor on its mass or inertia, inertia in other axes or about another point."""
    mechanism: Mechanism = evidence.element.mechanism
    mass, com, inertia = _of_bodies(mechanism)
    for i, body in enumerate(mechanism.bodies if len(mechanism.bodies) > 1 else ()):
        for what, values in (("mass", mass), ("inertia", inertia)):

            def change(x: float, what: str = what, values: FloatArray = values, i: int = i) -> Change:
                scaled = (np.where(np.arange(len(values)) == i, x, 1.0) * values.T).T
                return Change(mechanism, **{what: scaled})  # type: ignore[arg-type]  # an array by its name

            says, remedy = f"the engine moves the body {body.name} with its {what}", f"give {body.name} its {what} once"
            yield from residuals.scaled(f"{what} of {body.name}", says, change, remedy, what, signed=False)
    for says, other_inertia in _reordered(inertia):
        remedy = "look at the order of moments and products of inertia, and at the sign of the products"
        yield CauseRow("order of inertia", says, Change(mechanism, inertia=other_inertia), remedy, quantity="inertia")
    if not np.any(com):
        return
    for says, other_inertia in _about_origin(mass, com, inertia):
        remedy = "the scene's inertia is about the centre of mass, in the body's axes"
        yield CauseRow("point of inertia", says, Change(mechanism, inertia=other_inertia), remedy, quantity="inertia")
    says = "the weights act at the origins of the bodies' frames, not at the centres of mass"
    model = Change(mechanism, weight_at_origin=True)
    yield CauseRow("place of weight", says, model, "put the weight at the centre of mass")
    says = "the centres of mass are taken to be at the origins of the bodies' frames"
    model = Change(mechanism, com=np.zeros_like(com))
    yield CauseRow("centre of mass", says, model, "give the centres of mass", quantity="centre of mass")


def _reordered(inertia: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Moments of inertia along other axes, products of inertia with the wrong sign, each with a clause."""
    for order in list(itertools.permutations(range(3)))[1:]:
        shown = ", ".join("xyz"[k] for k in order)
        says = f"the moments of inertia are in another order: those about x, y, z are the scene's about {shown}"
        yield says, inertia[:, order][:, :, order]
    mirrored = inertia * (2 * np.eye(3) - 1)
    if not np.array_equal(mirrored, inertia):
        yield "the products of inertia have the wrong sign", mirrored


def _about_origin(mass: FloatArray, com: FloatArray, inertia: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Inertias with Steiner's part added once too often or too few, of all bodies or one, each with a clause."""
    for sign, words in ((1.0, "with Steiner's part added once more"), (-1.0, "with Steiner's part taken away")):
        for which in (np.ones(len(mass)), *np.eye(len(mass))):
            moved = inertia + sign * which[:, None, None] * steiner(mass, com)
            if np.min(np.linalg.eigvalsh(moved)) >= 0:
                yield f"the inertia is about the wrong point: that about the centre of mass {words}", moved


@by_rows("damped motion", "the equations are linear in it: one rate balances them at every state of the run")
def damped_motion(evidence: Evidence, residuals: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: velocities or spins of bodies, or both, decay at one rate, as engines for games have it.

    Only free bodies, or all momenta of several, tell it from damping in joints.
    """
    mechanism, period = evidence.element.mechanism, evidence.element.natural_time
    remedy = "find the engine's own damping, drag or sleeping, and switch it off"
    free = any(joint.kind == JointKind.FREE for joint in mechanism.joints)
    kinds = [("velocities", 1.0, 0.0), ("spins", 0.0, 1.0)] if free else []
    kinds += [("velocities and spins", 1.0, 1.0)] if free or len(mechanism.bodies) > 1 else []
    for what, linear, angular in kinds:

        def decaying(rate: FloatArray, linear: float = linear, angular: float = angular) -> Change:
            return Change(mechanism, decay=(float(rate[0]) * linear, float(rate[0]) * angular))

        rate = residuals.numbers_of(decaying, 1)
        if rate[0] > 0:
            says = f"{what} of all bodies are damped at a rate of {rate[0]:.4g} per second"
            yield CauseRow("damped motion", says, decaying(rate), remedy, fitted=1, change=float(rate[0]) * period)


@by_rows("several numbers", "the equations are linear in all of them: one fit balances them at every state of the run")
def of_several(evidence: Evidence, residuals: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: two or three of gravity, gyroscopic moments and the decay of all momenta, solved together."""
    mechanism: Mechanism = evidence.element.mechanism
    g = np.array(mechanism.gravity)
    remedy = "find these terms in the engine, each alone"

    def model(x: FloatArray) -> Change:
        return Change(mechanism, gravity=(1 + x[0]) * g, gyroscopic=1 + float(x[1]), decay=(float(x[2]), float(x[2])))

    rows = np.eye(3)
    plain = residuals.left(model(np.zeros(3)))
    least = np.minimum(residuals.leaves, residuals.closes * residuals.before)
    kept = [k for k in range(3) if np.any(residuals.left(model(rows[k])) != plain)]
    values = np.zeros(3)
    while len(kept) > 1:
        values = rows[:, kept] @ residuals.numbers_of(lambda x: model(rows[:, kept] @ x), len(kept))
        shares = [
            float(np.max(np.abs(residuals.left(model(values[k] * rows[k])) - plain) / least, initial=0.0)) for k in kept
        ]
        if min(shares) > 1:  # below it a number is within its error
            break
        kept.pop(int(np.argmin(shares)))
    factors = {name: 1 + values[k] for k, name in enumerate(("gravity", "the gyroscopic moments w x I w")) if k in kept}
    if len(kept) < 2 or values[2] < 0 or not all(possible(factor, signed=True) for factor in factors.values()):
        return
    words = [f"{name} {factor_text(factor)}" for name, factor in factors.items()]
    words += [f"velocities and spins of all bodies damped at a rate of {values[2]:.4g} per second"] if 2 in kept else []
    says = f"the engine moves it with {' and '.join(words)}"
    yield CauseRow("several numbers", says, model(values), remedy, fitted=len(kept))


@by_rows("friction of one joint", _ONE_FACTOR)
def friction_of_each_joint(evidence: Evidence, residuals: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: one of several joints has dry friction with a factor."""
    mechanism: Mechanism = evidence.element.mechanism
    joints = zip(mechanism.joints, mechanism.v_slices, strict=True)
    rough = [(joint, columns) for joint, columns in joints if joint.friction]
    for joint, columns in rough if len(rough) > 1 else ():
        of_joint = np.eye(mechanism.nv)[columns].sum(axis=0)

        def change(x: float, which: FloatArray = of_joint) -> Change:
            return Change(mechanism, friction=1 + (x - 1) * which)

        says = f"the engine moves it with the dry friction of the joint {joint.name}"
        remedy = f"give {joint.name} its dry friction, against the motion"
        yield from residuals.scaled(f"friction of {joint.name}", says, change, remedy)


@by_rows("joint", "the equations are linear in it: one coefficient balances them at every state of the run")
def of_each_joint(evidence: Evidence, residuals: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: one joint, or every joint, has additional damping or armature.

    Coarse steps have the same effect. So the row states how large the change is: the armature, or damping times
    natural time, relative to the inertia that the joint moves at the start. Damping that a first-order scheme adds by
    itself at the engine's step (implicit Euler: half the stiffness times the step) accuses nothing.
    """
    mechanism: Mechanism = evidence.element.mechanism
    equations = JointCoordinates(mechanism)
    inertia = np.diag(equations.inertial(equations.tree.at(*mechanism.start()))[1])
    joints = zip(mechanism.joints, mechanism.v_slices, strict=True)
    choices = [(f"the joint {joint.name}", np.eye(mechanism.nv)[columns].sum(axis=0)) for joint, columns in joints]
    if len(choices) > 1:
        choices = [("every joint", np.ones(mechanism.nv)), *choices]
    kinds = (("an armature (rotor inertia)", "armature", 1.0), ("damping", "damping", evidence.element.natural_time))
    for (owner, which), (what, law, size) in itertools.product(choices, kinds):
        numbers = np.array([getattr(joint, law) for joint in mechanism.joints for _ in range(joint.nv)])

        def more(value: FloatArray, which: FloatArray = which, law: str = law) -> Change:
            return Change(mechanism, **{f"added_{law}": value[0] * which})

        value = residuals.numbers_of(more, 1)
        if value[0] and np.all(numbers + value[0] * which >= 0):
            says = f"{owner} has {what} of {value[0]:.4g} more than the scene gives it"
            remedy = f"set {law} of the joints yourself, also where it is zero"
            change = abs(float(value[0]) * size) / float(np.min(inertia[which > 0]))
            yield CauseRow(f"{what} in {owner}", says, more(value), remedy, fitted=1, change=change)


@by_rows("direction of gravity", "the equations are linear in gravity: one vector closes them at every state")
def any_gravity(evidence: Evidence, residuals: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: gravity has another direction or magnitude."""
    mechanism: Mechanism = evidence.element.mechanism
    g, name, remedy = np.array(mechanism.gravity), "direction of gravity", "look at the axes of gravity"
    size = float(np.linalg.norm(g))
    for axis in (*np.eye(3), *-np.eye(3)):
        if np.any(np.cross(axis, g)):
            says = f"the engine's gravity is ({_shown(size * axis)}) m/s^2, along another axis"
            yield CauseRow(name, says, Change(mechanism, gravity=size * axis), remedy, quantity="gravity")
    gravity = g + residuals.numbers_of(lambda more: Change(mechanism, gravity=g + more), 3)
    gravity = np.where(np.abs(gravity) < 1e-6 * max(float(np.max(np.abs(gravity))), 1e-300), 0.0, gravity)
    change, says = float(np.linalg.norm(gravity - g)), f"the engine's gravity is ({_shown(gravity)}) m/s^2"
    model, change = Change(mechanism, gravity=gravity), change / size if size else np.inf
    yield CauseRow(name, says, model, remedy, quantity="gravity", fitted=3, change=change)


def _shown(gravity: FloatArray) -> str:
    return ", ".join(f"{x:.4g}" for x in gravity + 0.0)  # not -0


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
        at_rest = to_rpy(bushing.frame_b @ bushing.frame_a.T)
        along_body = replace(bushing, orientation_a=ZERO, orientation_b=at_rest)
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
