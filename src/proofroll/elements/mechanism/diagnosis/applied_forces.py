"""Hypotheses of applied forces in other axes, at other places, without their reaction, or late."""

from collections.abc import Iterator
from dataclasses import replace

from proofroll.core.diagnosis import Cause, Evidence, hypothesis
from proofroll.core.diagnosis.fitting import change_by, factor_text, possible
from proofroll.elements.mechanism.checks import WORLD, ZERO
from proofroll.elements.mechanism.diagnosis.equations import Change
from proofroll.elements.mechanism.diagnosis.residuals import best, residuals_of
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.parts import Axes, Force
from proofroll.elements.mechanism.signal import delayed, varies


@hypothesis(
    "applied force",
    "the equations of motion balance at every state of the run with that force, and not with the scene's",
)
def of_applied_forces(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: one applied force with a factor, in other axes, at another place, without reaction, or late."""
    mechanism = evidence.element.mechanism
    for residuals in residuals_of(evidence):
        for number, force in enumerate(mechanism.forces):
            for says, changed, remedy in _mistakes(mechanism, force, evidence.step):
                model = Change(_with(mechanism, number, changed))
                yield residuals.cause(f"force {force.name}", f"{force.kind} {force.name} {says}", model, remedy, 0)

            def scaled(x: float, number: int = number, force: Force = force) -> Change:
                return Change(_with(mechanism, number, force), factors_of_forces=((number, x),))

            factor, fitted = best(residuals, scaled)
            if possible(factor, signed=True):
                says = f"the engine moves it with the {force.kind} {force.name} {factor_text(factor)}"
                remedy = f"give {force.name} its value, on {force.body}"
                yield residuals.cause(f"size of {force.name}", says, scaled(factor), remedy, fitted, change_by(factor))


def _mistakes(mechanism: Mechanism, force: Force, step: float | None) -> Iterator[tuple[str, Force, str]]:
    """Words, changed force and remedy of each mistake that would change this force."""
    frame: Axes = "world" if force.frame == "body" else "body"
    axes = {"world": "of the world", "body": f"of {force.body}"}
    says = f"acts along the axes {axes[frame]}, not {axes[force.frame]}"
    yield says, replace(force, frame=frame), "look at whose axes its components are along"
    if force.kind == "force":
        com = next(body.com for body in mechanism.bodies if body.name == force.body)
        for place, words in ((com, "the centre of mass"), (ZERO, "the origin")):
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
