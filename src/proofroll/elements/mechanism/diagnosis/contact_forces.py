"""Hypotheses of contact forces that are reported wrongly, along a run and at time 0."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proofroll.core.arrays import FloatArray, cross, known_difference, longest
from proofroll.core.diagnosis import CLOSES, Cause, Difference, Evidence, hypothesis
from proofroll.core.diagnosis.clocks import delay_text, in_steps
from proofroll.core.diagnosis.fitting import factor_text, known_factor, least_squares_parameter
from proofroll.core.diagnosis.vectors import ReportedVector
from proofroll.elements.mechanism.diagnosis.contacts import FORCES_AT_START, SeenContact, forces_of_lines, touch_of
from proofroll.elements.mechanism.diagnosis.equations import placed_of
from proofroll.elements.mechanism.diagnosis.reporting_errors import SURFACE, surface_axes
from proofroll.elements.mechanism.run.contacts.observables import follow_contacts
from proofroll.elements.mechanism.scene.model import Mechanism

_OF_MASS = (0.5, 2.0, 1e-3, 1e3)  # factors of masses that are known mistakes
_STEP = 1e-3  # delay that a fit tries where there is no step [s]
_FEWEST = 4  # samples through which a curve of normals is laid


@hypothesis("contact forces", "the engine reports the true forces with another sign, frame or time")
def contact_forces(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: contact forces are reported on the other body, in other axes, with other friction, or late."""
    for touch in touch_of(evidence):
        true_ones = touch.true_force[1:]
        finite = np.asarray(np.isfinite(true_ones).all(axis=(0, 2)))
        if not touch.moves_as_true or not finite.any() or "contact_forces" in evidence.settled:
            continue  # forces of another motion cannot be compared
        axes = surface_axes(evidence.element, placed_of(touch.mechanism, evidence.truth))
        axes = None if axes is None else axes[1:]
        vector = _vector(evidence.element, touch.force[1:, finite], true_ones[:, finite], touch.time[1:], axes)
        yield from _causes(vector, touch.true.normal[1:, finite], evidence, read_back=evidence.read_back("mass"))
        yield from _along_earlier_normals(vector, touch, finite)


@hypothesis("contact forces at time 0", "the certificate's forces have another sign, other axes or other friction")
def forces_at_start(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses of contact forces at time 0: sign, axes, sign of friction, masses."""
    element, pair = evidence.element, forces_of_lines(evidence)
    others = [line for line in evidence.lines if line["quantity"] != FORCES_AT_START]
    if pair is None or not pair[2].any() or not all(line["holds"] for line in others):
        return
    reported, true, finite = pair
    axes = surface_axes(element, element.start)
    vector = _vector(element, reported[None, finite], true[None, finite], np.zeros(1), axes)
    yield from _causes(vector, follow_contacts(element.start).normal[:, finite], evidence, read_back=False)


def _vector(
    element: Any, reported: FloatArray, true: FloatArray, time: FloatArray, axes: FloatArray | None
) -> ReportedVector:
    """Contact forces at times; ``axes``: of the wall at these, (times, 3, 3), or None."""
    return ReportedVector(
        name="contact_forces",
        what="the force of a contact on its first body",
        unit="N",
        reported=reported,
        true=true,
        time=time,
        frames={} if axes is None else {SURFACE: axes[:, None]},
        least=element.force,
    )


def _causes(vector: ReportedVector, normals: FloatArray, evidence: Evidence, *, read_back: bool) -> Iterator[Cause]:
    """Causes of wrongly reported forces; ``normals``: of the contacts, shape of the forces.

    ``read_back``: True if the engine's masses are known to be the scene's.
    """
    if vector.differs:
        pressing_part = np.sum(vector.true * normals, axis=-1, keepdims=True) * normals
        says = "the friction has the wrong sign, and the normal forces are right"
        remedy = "give the friction on the first body, not on the second"
        yield vector.cause("friction sign", says, 2 * pressing_part - vector.true, remedy)
    yield from vector.causes(evidence.step)
    square = float(np.nansum(vector.true**2))
    factor = known_factor(float(np.nansum(vector.reported * vector.true)) / square) if square else None
    if factor is not None and factor[0] in _OF_MASS and not read_back and _by_masses_alone(evidence.element.mechanism):
        says = f"all masses and inertias are {factor_text(factor[0])}, which moves nothing otherwise"
        yield vector.cause("mass", says, factor[0] * vector.true, "give each body its mass and inertia once")


def _by_masses_alone(mechanism: Mechanism) -> bool:
    """True if all loads of a mechanism are proportional to its masses, so that a factor on them moves it alike."""
    laws = ("stiffness", "damping", "friction", "torque", "armature")
    loaded = any(getattr(joint, law) for joint in mechanism.joints for law in laws)
    return not (loaded or mechanism.links or mechanism.forces or mechanism.actuators)


def _along_earlier_normals(vector: ReportedVector, touch: SeenContact, finite: NDArray[np.bool_]) -> Iterator[Cause]:
    """Cause that forces have the right components, along axes that are turned as the normals of another time."""
    from scipy.interpolate import make_interp_spline

    normals, step = touch.true.normal[:, finite], touch.evidence.step or _STEP
    if not vector.differs or len(normals) < _FEWEST:
        return
    curve = make_interp_spline(touch.time, normals, k=3)
    n = normals[1:]

    def turned(delay: float) -> FloatArray:
        earlier = curve(vector.time - delay)
        axis, cosine = cross(n, earlier), np.sum(n * earlier, axis=-1, keepdims=True)
        turning = cross(axis, vector.true)
        return np.asarray(vector.true + turning + cross(axis, turning) / (1 + cosine))

    delay = least_squares_parameter(lambda x: np.ravel(turned(x) - vector.reported), 0.0, step)
    if longest(touch.found.normal[1:, finite] - n) > CLOSES * longest(curve(vector.time - delay) - n):
        return  # the bodies are as far off, which explains their forces
    moment = delay_text(delay, touch.evidence.step).rpartition(" ")[0]
    says = f"contact_forces are along the normal of {moment} {'before' if delay > 0 else 'later'}"
    remedy, change = "take the normal where the bodies are when the force is read", in_steps(delay, touch.evidence.step)
    remainder = known_difference(vector.reported, turned(delay))
    off = Difference(vector.name, vector.unit, vector.before)
    yield off.cause(f"stale normal.{vector.name}", says, remainder, remedy, 1, change=change)


REPORTED_FORCES = (contact_forces, forces_at_start)
