"""Hypotheses of wrong numbers: one factor on a number of all bodies, joints or springs, or of one of them."""

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence, Hypothesis, hypothesis
from proofroll.core.diagnosis.fitting import Residuals, change_by, factor_text, in_doubt, possible
from proofroll.elements.mechanism.diagnosis.equations import Change
from proofroll.elements.mechanism.diagnosis.residuals import best, residuals_of
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.model import Mechanism


def factor_of_all(
    name: str,
    what: str,
    change: Callable[[Mechanism, float], Change],
    has: Callable[[Mechanism], bool],
    remedy: str,
    signed: bool = True,
    line: str = "",
) -> Hypothesis:
    """Hypothesis that the engine moves all bodies or joints with one factor on a number.

    Args:
        name: of the hypothesis.
        what: the number, in the words of the cause.
        change: of a mechanism, for a factor.
        has: True if a mechanism has the number at all.
        remedy: advice to the author.
        signed: True if the engine may have the wrong sign of the number; masses are never negative.
        line: quantity of the certificate that reads the number back; empty: none does.
    """

    @hypothesis(name, "the equations of motion are linear in it: one factor balances them at every state of the run")
    def test(evidence: Evidence) -> Iterator[Cause]:
        mechanism = evidence.element.mechanism
        for residuals in residuals_of(evidence) if has(mechanism) else ():
            factor, fitted = best(residuals, lambda x: change(mechanism, x))
            other_model = change(mechanism, factor)
            told = possible(factor, signed) and in_doubt(evidence, residuals, line, fitted)
            if told and not _by_scheme(residuals, other_model):
                says = f"the engine moves it with {what} {factor_text(factor)}"
                yield residuals.cause(name, says, other_model, remedy, fitted, change_by(factor))

    return test


def _inertias(mechanism: Mechanism, x: float) -> Change:
    return Change(mechanism, inertia=x * np.array([body.inertia for body in mechanism.bodies]))


def _masses(mechanism: Mechanism, x: float) -> Change:
    return Change(mechanism, mass=x * np.array([body.mass for body in mechanism.bodies]))


def _of_joints(name: str, law: str, what: str, give: str) -> Hypothesis:
    """Hypothesis of one factor on a law of all joints; an armature, being an inertia, cannot have the wrong sign."""
    return factor_of_all(
        name,
        f"the {what} of the joints",
        lambda m, x: Change(m, **{law: x}),  # type: ignore[arg-type]  # a factor by its name
        lambda m: any(getattr(joint, law) for joint in m.joints),
        f"give the joints {give}",
        signed=law != "armature",
    )


FACTORS_OF_ALL: tuple[Any, ...] = (
    factor_of_all(
        "gravity",
        "gravity",
        lambda m, x: Change(m, gravity=x * np.array(m.gravity)),
        lambda m: any(m.gravity),
        "give the engine the scene's gravity: an acceleration in the world, its sign and its unit",
        line="gravity",
    ),
    factor_of_all(
        "mass", "all masses", _masses, lambda m: bool(m.bodies), "give each body its mass once", False, "mass"
    ),
    factor_of_all(
        "inertia",
        "all inertias",
        _inertias,
        lambda m: bool(m.bodies),
        "give each body its inertia once",
        signed=False,
        line="inertia",
    ),
    _of_joints(
        "joint damping",
        "damping",
        "damping",
        "their damping, as a moment per rad/s or a force per m/s against the motion",
    ),
    _of_joints("joint friction", "friction", "dry friction", "their dry friction, against the motion"),
    _of_joints("joint stiffness", "stiffness", "stiffness", "their stiffness, per rad or per m"),
    _of_joints("joint torque", "torque", "drives", "their drive, on the child against the parent"),
    _of_joints("armature", "armature", "armature", "their armature"),
    factor_of_all(
        "springs",
        "the stiffness of the springs",
        lambda m, x: Change(m, springs=x),
        lambda m: bool(m.springs),
        "give the springs their stiffness and free length",
    ),
    factor_of_all(
        "damping of springs",
        "the damping of the springs",
        lambda m, x: Change(m, spring_damping=x),
        lambda m: any(spring.damping for spring in m.springs),
        "give the springs their damping, along the line between their ends",
    ),
    factor_of_all(
        "springs with damping",
        "the springs",
        lambda m, x: Change(m, springs=x, spring_damping=x),
        lambda m: any(spring.damping for spring in m.springs),
        "give the springs their stiffness, damping and free length",
    ),
    factor_of_all(
        "bushings",
        "the bushings",
        lambda m, x: Change(m, bushings=x),
        lambda m: bool(m.bushings),
        "give the bushings their stiffness and damping",
    ),
    factor_of_all(
        "gyroscopic terms",
        "the gyroscopic moments w x I w",
        lambda m, x: Change(m, gyroscopic=x),
        lambda m: bool(m.bodies),
        "the rate of the angular momentum has the term w x I w",
    ),
)


@hypothesis("body", "one body has another mass or inertia, or its inertia about other axes or another point")
def of_each_body(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses on one body: a factor on its mass or inertia, inertia in other axes or about another point."""
    mechanism = evidence.element.mechanism
    mass = np.array([body.mass for body in mechanism.bodies])
    inertia, com = (np.array([getattr(body, key) for body in mechanism.bodies]) for key in ("inertia", "com"))
    for residuals in residuals_of(evidence):
        for i, body in enumerate(mechanism.bodies if len(mechanism.bodies) > 1 else ()):
            which = np.arange(len(mass)) == i

            for what, values in (("mass", mass), ("inertia", inertia)):

                def change(x: float, what: str = what, values: FloatArray = values, which: Any = which) -> Change:
                    scaled = (np.where(which, x, 1.0) * values.T).T
                    return Change(mechanism, **{what: scaled})  # type: ignore[arg-type]  # an array by its name

                factor, number = best(residuals, change)
                if not (possible(factor, False) and in_doubt(evidence, residuals, what, number)):
                    continue
                says = f"the engine moves the body {body.name} with its {what} {factor_text(factor)}"
                model, remedy = change(factor), f"give {body.name} its {what} once"
                yield residuals.cause(f"{what} of {body.name}", says, model, remedy, number, change_by(factor))
        if in_doubt(evidence, residuals, "inertia"):
            yield from _reordered(residuals, mechanism, inertia)
        if np.any(com) and in_doubt(evidence, residuals, "inertia"):
            yield from _about_origin(residuals, mechanism, mass, com, inertia)
        if np.any(com):
            says = "the weights act at the origins of the bodies' frames, not at the centres of mass"
            model = Change(mechanism, weight_at_origin=True)
            yield residuals.cause("place of weight", says, model, "put the weight at the centre of mass", 0)
        if np.any(com) and in_doubt(evidence, residuals, "centre of mass"):
            says = "the centres of mass are taken to be at the origins of the bodies' frames"
            model = Change(mechanism, com=np.zeros_like(com))
            yield residuals.cause("centre of mass", says, model, "give the centres of mass", 0)


def _reordered(residuals: Residuals[Change], mechanism: Mechanism, inertia: FloatArray) -> Iterator[Cause]:
    """Hypotheses: moments of inertia along other axes, products of inertia with the wrong sign."""
    remedy = "look at the order of moments and products of inertia, and at the sign of the products"
    for order in list(itertools.permutations(range(3)))[1:]:
        other_inertia = inertia[:, order][:, :, order]
        shown = ", ".join("xyz"[k] for k in order)
        says = f"the moments of inertia are in another order: those about x, y, z are the scene's about {shown}"
        yield residuals.cause("order of inertia", says, Change(mechanism, inertia=other_inertia), remedy, 0)
    mirrored = inertia * (2 * np.eye(3) - 1)
    if not np.array_equal(mirrored, inertia):
        says = "the products of inertia have the wrong sign"
        yield residuals.cause("order of inertia", says, Change(mechanism, inertia=mirrored), remedy, 0)


def _about_origin(
    residuals: Residuals[Change], mechanism: Mechanism, mass: FloatArray, com: FloatArray, inertia: FloatArray
) -> Iterator[Cause]:
    """Hypotheses: Steiner's part added once too often or too few."""
    steiner = mass[:, None, None] * (
        np.einsum("ni,ni->n", com, com)[:, None, None] * np.eye(3) - com[:, :, None] * com[:, None, :]
    )
    remedy = "the scene's inertia is about the centre of mass, in the body's axes"
    for sign, words in ((1.0, "with Steiner's part added once more"), (-1.0, "with Steiner's part taken away")):
        says = f"the inertia is about the wrong point: that about the centre of mass {words}"
        for which in (np.ones(len(mass)), *np.eye(len(mass))):
            moved = inertia + sign * which[:, None, None] * steiner
            if np.min(np.linalg.eigvalsh(moved)) >= 0:
                yield residuals.cause("point of inertia", says, Change(mechanism, inertia=moved), remedy, 0)


@hypothesis("damped motion", "the equations are linear in it: one rate balances them at every state of the run")
def damped_motion(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: velocities or spins of bodies, or both, decay at one rate, as engines for games have it.

    Only free bodies, or all momenta of several, tell it from damping in joints.
    """
    mechanism, period = evidence.element.mechanism, evidence.element.natural_time
    remedy = "find the engine's own damping, drag or sleeping, and switch it off"
    free = any(joint.kind == JointKind.FREE for joint in mechanism.joints)
    kinds = [("velocities", (1.0, 0.0)), ("spins", (0.0, 1.0))] if free else []
    kinds += [("velocities and spins", (1.0, 1.0))] if free or len(mechanism.bodies) > 1 else []
    for residuals in residuals_of(evidence) if kinds else ():
        plain = residuals.left(Change(mechanism))
        for what, which in kinds:
            slope = residuals.left(Change(mechanism, decay=which)) - plain
            square = float(slope @ slope)
            rate = -float(slope @ plain) / square if square else 0.0
            if rate > 0:
                says = f"{what} of all bodies are damped at a rate of {rate:.4g} per second"
                model = Change(mechanism, decay=(rate * which[0], rate * which[1]))
                yield residuals.cause("damped motion", says, model, remedy, 1, rate * period)


@hypothesis(
    "several numbers", "the equations are linear in all of them: one fit balances them at every state of the run"
)
def of_several(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: two or more terms of all bodies or joints have factors, or their momenta decay; solved together."""
    mechanism = evidence.element.mechanism
    gravity = np.array(mechanism.gravity)
    terms: dict[str, Callable[[float], dict[str, Any]]] = {
        "gravity": lambda x: {"gravity": (1 + x) * gravity},
        "the gyroscopic moments w x I w": lambda x: {"gyroscopic": 1 + x},
        "the damping of the joints": lambda x: {"damping": 1 + x},
        "the stiffness of the joints": lambda x: {"stiffness": 1 + x},
        "velocities and spins": lambda x: {"decay": (x, x)},
    }
    for residuals in residuals_of(evidence):
        plain = residuals.left(Change(mechanism))
        columns = {name: residuals.left(Change(mechanism, **term(1.0))) - plain for name, term in terms.items()}
        names = [name for name, column in columns.items() if np.any(column)]
        least = np.broadcast_to(np.minimum(residuals.leaves, residuals.closes * residuals.before), plain.shape)
        values: FloatArray = np.zeros(0)
        while len(names) > 1:
            slopes = np.stack([columns[name] for name in names], axis=-1)
            values = -np.linalg.lstsq(slopes, plain, rcond=None)[0]
            shares = np.max(np.abs(slopes * values) / least[:, None], axis=0)  # below 1: within its error
            if np.min(shares) > 1:
                break
            names.pop(int(np.argmin(shares)))
        found = dict(zip(names, values.tolist(), strict=False))
        rate = found.pop("velocities and spins", 0.0)
        if (
            len(names) < 2
            or rate < 0
            or not all(possible(1 + value, name == "gravity") for name, value in found.items())
        ):
            continue
        says = [f"{name} {factor_text(1 + value)}" for name, value in found.items()]
        says += [f"velocities and spins of all bodies damped at a rate of {rate:.4g} per second"] if rate else []
        model = Change(
            mechanism,
            **{key: item for name, x in zip(names, values, strict=True) for key, item in terms[name](x).items()},
        )
        words, remedy = f"the engine moves it with {' and '.join(says)}", "find these terms in the engine, each alone"
        yield residuals.cause("several numbers", words, model, remedy, len(names))


@hypothesis(
    "friction of one joint", "the equations are linear in it: one factor balances them at every state of the run"
)
def friction_of_each_joint(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: one of several joints has dry friction with a factor."""
    mechanism = evidence.element.mechanism
    rough = [
        (joint, columns) for joint, columns in zip(mechanism.joints, mechanism.v_slices, strict=True) if joint.friction
    ]
    for residuals in residuals_of(evidence) if len(rough) > 1 else ():
        for joint, columns in rough:
            which = np.eye(mechanism.nv)[columns].sum(axis=0)

            def change(x: float, which: FloatArray = which) -> Change:
                return Change(mechanism, friction=1 + (x - 1) * which)

            factor, number = best(residuals, change)
            if possible(factor, signed=True):
                says = f"the engine moves it with the dry friction of the joint {joint.name} {factor_text(factor)}"
                remedy = f"give {joint.name} its dry friction, against the motion"
                name = f"friction of {joint.name}"
                yield residuals.cause(name, says, change(factor), remedy, number, change_by(factor))


@hypothesis("joint", "the equations are linear in it: one coefficient balances them at every state of the run")
def of_each_joint(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: one joint, or every joint, has additional damping or armature.

    Coarse steps have the same effect. So the cause states how large the change is: the armature, or damping times
    natural time, relative to the inertia that the joint moves at the start. Damping that a first-order scheme adds by
    itself at the engine's step (implicit Euler: half the stiffness times the step) accuses nothing.
    """
    mechanism = evidence.element.mechanism
    equations = JointCoordinates(mechanism)
    q, v = mechanism.start()
    inertia = np.diag(equations.inertial(equations.tree.at(q, v))[1])
    for residuals in residuals_of(evidence):
        joints = zip(mechanism.joints, mechanism.v_slices, strict=True)
        choices = [(f"the joint {joint.name}", np.eye(mechanism.nv)[columns].sum(axis=0)) for joint, columns in joints]
        numbers = {
            key: [getattr(j, key) for j in mechanism.joints for _ in range(j.nv)] for key in ("armature", "damping")
        }
        if len(choices) > 1:
            choices = [("every joint", np.ones(mechanism.nv)), *choices]
        for owner, which in choices:
            for what, has in (("an armature (rotor inertia)", "armature"), ("damping", "damping")):
                key = f"added_{has}"
                columns = residuals.left(Change(mechanism))
                slope = residuals.left(Change(mechanism, **{key: which})) - columns
                square = float(slope @ slope)
                if not square:
                    continue
                value = -float(slope @ columns) / square
                if np.any(numbers[has] + value * which < 0):
                    continue
                says = f"{owner} has {what} of {value:.4g} more than the scene gives it"
                size = value * {"armature": 1.0, "damping": evidence.element.natural_time}[has]
                remedy = f"set {has} of the joints yourself, also where it is zero"
                change = Change(mechanism, **{key: value * which})
                if _by_scheme(residuals, change):
                    continue
                part = abs(size) / float(np.min(inertia[which > 0]))
                yield residuals.cause(f"{what} in {owner}", says, change, remedy, 1, part)


def _by_scheme(residuals: Residuals[Change], change: Change) -> bool:
    """True if a change is damping alone, and a first-order scheme leaves as much by itself at the engine's step."""
    mechanism = change.mechanism
    damping = np.array([joint.damping for joint in mechanism.joints for _ in range(joint.nv)])
    added = (change.damping - 1.0) * damping + change.added_damping
    if np.any(added < 0) or not np.any(added > 0):
        return False
    least = np.maximum(residuals.scheme, residuals.closes * residuals.before)
    return bool(np.all(np.abs(residuals.left(residuals.plain)) <= least))
