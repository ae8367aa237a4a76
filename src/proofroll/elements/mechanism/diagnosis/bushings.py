"""Hypotheses of bushings whose axes are exchanged, or are those of a body."""

from collections.abc import Iterator
from dataclasses import replace

from proofroll.core.diagnosis import Cause, Evidence, hypothesis
from proofroll.elements.mechanism.diagnosis.equations import Change
from proofroll.elements.mechanism.diagnosis.residuals import residuals_of
from proofroll.elements.mechanism.scene.bushing import Bushing, Six
from proofroll.elements.mechanism.scene.checks import ZERO
from proofroll.elements.mechanism.scene.rotations import to_rpy

# Axes in another order: words, numbers of the axes whose values they take.
_ORDERS = (
    ("exchanges x and y", (1, 0, 2)),
    ("exchanges y and z", (0, 2, 1)),
    ("exchanges z and x", (2, 1, 0)),
    ("shifts x to y, y to z, z to x", (2, 0, 1)),
    ("shifts x to z, z to y, y to x", (1, 2, 0)),
)


@hypothesis(
    "bushing",
    "the equations of motion balance at every state of the run with that bushing, and not with the scene's",
)
def of_bushings(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: one bushing with its axes in another order, along those of a body, or without its dampers."""
    mechanism = evidence.element.mechanism
    for residuals in residuals_of(evidence):
        for number, bushing in enumerate(mechanism.bushings):
            for says, other_bushing, remedy in _mistakes(bushing):
                bushings = (*mechanism.bushings[:number], other_bushing, *mechanism.bushings[number + 1 :])
                model = Change(replace(mechanism, bushings=bushings))
                yield residuals.cause(f"bushing {bushing.name}", f"bushing {bushing.name} {says}", model, remedy, 0)


def _mistakes(bushing: Bushing) -> Iterator[tuple[str, Bushing, str]]:
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
