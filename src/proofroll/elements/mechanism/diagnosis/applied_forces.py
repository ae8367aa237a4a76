"""Hypotheses of applied forces in other axes, at other places, without their reaction, or late."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from proofroll.core.diagnosis import Cause, Evidence, hypothesis
from proofroll.core.diagnosis.fitting import Residuals, change_by, factor_text, possible
from proofroll.elements.mechanism.diagnosis.equations import Change
from proofroll.elements.mechanism.diagnosis.residuals import best, residuals_of
from proofroll.elements.mechanism.scene.checks import WORLD, ZERO
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.parts import Axes, Force
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import delayed, varies


@hypothesis(
    "applied force",
    "the equations of motion balance at every state of the run with that force, and not with the scene's",
)
def of_applied_forces(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: one applied force with a factor, in other axes, at another place, without reaction, or late."""
    mechanism = evidence.element.mechanism
    for residuals in residuals_of(evidence):
        for number, force in enumerate(mechanism.forces):
            for says, other_force, remedy in _mistakes(mechanism, force, evidence.step):
                model = Change(_with(mechanism, number, other_force))
                yield residuals.cause(f"force {force.name}", f"{force.kind} {force.name} {says}", model, remedy, 0)

            def scaled(x: float, number: int = number, force: Force = force) -> Change:
                return Change(_with(mechanism, number, force), factors_of_forces=((number, x),))

            factor, fitted = best(residuals, scaled)
            if possible(factor, signed=True):
                says = f"the engine moves it with the {force.kind} {force.name} {factor_text(factor)}"
                remedy = f"give {force.name} its value, on {force.body}"
                yield residuals.cause(f"size of {force.name}", says, scaled(factor), remedy, fitted, change_by(factor))
            if force.kind == "force":
                yield _elsewhere(residuals, mechanism, number, evidence.element.length)


def _elsewhere(residuals: Residuals[Change], mechanism: Mechanism, number: int, length: float) -> Cause:
    """Hypothesis: the force acts along another line, through its nearest place that balances the equations."""
    force = mechanism.forces[number]

    def at(place: Array) -> Change:
        x, y, z = map(float, place)
        return Change(_with(mechanism, number, replace(force, position=(x, y, z))))

    position = np.array(force.position)
    left = residuals.left(at(position))
    slopes = [residuals.left(at(position + axis)) - left for axis in np.eye(3)]
    shift = -np.linalg.lstsq(np.stack(slopes, axis=-1), left, rcond=1e-6)[0]
    place = np.where(np.abs(position + shift) < 1e-6 * length, 0.0, position + shift)
    words = ", ".join(f"{x:.3g}" for x in place)
    says = f"force {force.name} acts along a line through ({words}) m of {force.body}, not through its place"
    remedy = f"give its place in the axes of {force.body}, from the origin of its frame"
    size = float(np.linalg.norm(shift)) / length
    return residuals.cause(f"place of {force.name}", says, at(place), remedy, 3, size)


def _mistakes(mechanism: Mechanism, force: Force, step: float | None) -> Iterator[tuple[str, Force, str]]:
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


def _with(mechanism: Mechanism, number: int, force: Force) -> Mechanism:
    forces = (*mechanism.forces[:number], force, *mechanism.forces[number + 1 :])
    return replace(mechanism, forces=forces)
