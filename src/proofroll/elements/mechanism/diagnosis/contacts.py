"""Hypotheses of contacts: a wrong coefficient, a missing contact, another law, forces that are reported wrongly."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proofroll.core.arrays import FloatArray, cross, known_difference, longest
from proofroll.core.diagnosis import CLOSES, METHOD, Cause, Difference, Evidence, hypothesis
from proofroll.core.diagnosis.fitting import (
    cached_on_evidence,
    change_by,
    factor_text,
    known_factor,
    least_squares_parameter,
)
from proofroll.core.diagnosis.samples import run_and_truth
from proofroll.core.diagnosis.vectors import ReportedVector, delay_text, in_steps
from proofroll.elements.mechanism.diagnosis.equations import is_motion, placed_of
from proofroll.elements.mechanism.diagnosis.reporting_errors import SURFACE, surface_axes
from proofroll.elements.mechanism.diagnosis.residuals import TOUCHING_MOTION
from proofroll.elements.mechanism.run.contacts.observables import (
    PRESSES,
    SLIDES,
    Followed,
    follow_contacts,
    normal_forces,
)
from proofroll.elements.mechanism.scene.model import Mechanism

_OF_MASS = (0.5, 2.0, 1e-3, 1e3)  # factors of masses that are known mistakes
_STEP = 1e-3  # delay that a fit tries where there is no step [s]
_FEWEST = 4  # samples through which a curve of normals is laid
# Least difference of forces and least overlap that point to another law, relative to the mechanism's force and size.
FORCE, _SUNK = 1e-4, 1e-3
_OFF = 1e-3  # largest factor of friction that counts as zero
_TURNS = 0.3  # rad: least turn of slip and friction that shows the shape of a cone
_FEW = 3  # samples of friction from which a square does not fit by chance
_ANGLES = np.linspace(0.0, np.pi / 2, 181)[:-1]
_UNCONVEX = "no step mends it: set cone_correction=true where the engine has it, or take Coulomb's own law"
_HELD = 1e-6  # slip speed of the truth that counts as sticking, relative to the mechanism's speed
FORCES_AT_START = "forces of contact"  # line of the certificate


@dataclass(frozen=True)
class SeenContact:
    """Contacts of a run and of the truth, with forces; arrays over (time, contacts).

    Attributes:
        evidence: run, truth and certificate.
        time: [s], (time,).
        found, true: gaps, normals and slides of the run and of the truth.
        force, true_force: on body a of each contact [N], (time, contacts, 3).
        N: normal forces of the run [N].
        u_n: speed along the normal [m/s].
        presses, slides: True where a contact presses, and where it also slides.
    """

    evidence: Evidence
    time: FloatArray
    found: Followed
    force: FloatArray
    N: FloatArray
    u_n: FloatArray
    presses: NDArray[np.bool_]
    slides: NDArray[np.bool_]
    true: Followed
    true_force: FloatArray

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism of the contacts."""
        mechanism: Mechanism = self.evidence.element.mechanism
        return mechanism

    @property
    def friction(self) -> FloatArray:
        """Coefficient of each contact; 0 of those that never slip, whose law has no number."""
        friction = np.array([contact.friction for contact in self.mechanism.contacts])
        return np.where(np.isinf(friction), 0.0, friction)

    @property
    def across(self) -> FloatArray:
        """Slip velocity along the surfaces [m/s], (time, contacts, 3)."""
        return np.asarray(self.found.slide - self.u_n[..., None] * self.found.normal)

    @property
    def T(self) -> FloatArray:
        """Friction [N], (time, contacts, 3)."""
        return np.asarray(self.force - self.N[..., None] * self.found.normal)

    @property
    def against(self) -> FloatArray:
        """Coulomb friction of the run's own normal forces against its own slip [N], (time, contacts, 3)."""
        slip = np.where(self.found.slip > 0, self.found.slip, 1.0)
        return np.asarray(-(self.friction * self.N / slip)[..., None] * self.across)

    @property
    def moves_as_true(self) -> bool:
        """True if the slides of the contacts are the true ones: forces that differ there are only reported."""
        return bool(longest(self.found.slide - self.true.slide) <= _SUNK * self.evidence.element.speed)

    def has_true_friction(self, which: NDArray[np.bool_]) -> bool:
        """True if the friction, or the motion of all, is the true one: no law of friction explains an error."""
        if self.moves_as_true:
            return True
        force, normal = self.true_force[which], self.true.normal[which]
        true = force - np.sum(force * normal, axis=-1, keepdims=True) * normal
        return bool(longest(self.T[which] - true) <= FORCE * self.evidence.element.force)


@cached_on_evidence
def touch_of(evidence: Evidence) -> Iterator[SeenContact]:
    """Contacts of the run; nothing if it has none or does not report their forces."""
    pair, element = run_and_truth(evidence), evidence.element
    if pair is None or not element.mechanism.contacts or "contact_forces" not in pair[0] or not is_motion(pair[0]):
        return
    run, truth = pair
    followed = follow_contacts(placed_of(element.mechanism, run))
    force = run["contact_forces"].to_numpy()
    if np.isnan(force[1:]).any():
        return
    N = normal_forces(followed, force)
    presses = np.asarray(PRESSES * element.force < N)
    presses[0] = False  # several engines know no force there
    separate = [contact.cone == "separate" for contact in element.mechanism.contacts]  # others share Coulomb's bound
    slides = presses & np.asarray(followed.slip > SLIDES * element.speed) & separate
    true = follow_contacts(placed_of(element.mechanism, truth))
    u_n = np.sum(followed.normal * followed.slide, axis=-1)
    yield SeenContact(
        evidence=evidence,
        time=run["time"].to_numpy(),
        found=followed,
        force=force,
        N=N,
        u_n=u_n,
        presses=presses,
        slides=slides,
        true=true,
        true_force=truth["contact_forces"].to_numpy(),
    )


@hypothesis("friction of contacts", "sliding friction is one factor times its bound, against the slip, in every sample")
def friction_factor(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: one contact, or all, have a coefficient of friction with a factor."""
    for touch in touch_of(evidence):
        names = [contact.name for contact in touch.mechanism.contacts]
        groups = [(list(range(len(names))), "all contacts"), *(([k], name) for k, name in enumerate(names))]
        for which, name in groups[: 1 if len(names) == 1 else None]:
            sliding = touch.slides & (touch.friction > 0) & np.isin(range(len(names)), which)
            T, full = touch.T[sliding], touch.against[sliding]
            if len(T) < 2 or longest(T - full) <= FORCE * evidence.element.force or touch.has_true_friction(sliding):
                continue
            factor = float(np.sum(T * full) / np.sum(full * full))
            off = abs(factor) <= _OFF
            says = f"friction of {name} is {'off' if off else factor_text(factor)}"
            remainder = longest(T - (0.0 if off else factor) * full)
            remedy, change = "give each pair its own coefficient", change_by(factor)
            # one number takes away a part of any difference; of a right one the error of the step alone is left
            friction = Difference("friction of what slides", "N", longest(T - full), TOUCHING_MOTION, closes=METHOD)
            yield friction.cause("friction", says, remainder, remedy, 0 if off else 1, change=change)


@hypothesis("contact left out", "a contact never presses, and its shapes overlap where the truth presses them apart")
def left_out(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: the engine lacks a pair."""
    for touch in touch_of(evidence):
        true = normal_forces(touch.true, touch.true_force)
        for k, contact in enumerate(touch.mechanism.contacts):
            sunk = float(touch.found.gap[:, k].min()) < -_SUNK * evidence.element.length
            if sunk and not touch.presses[:, k].any():
                difference, remainder = float(np.nanmax(np.abs(true[1:, k]))), float(np.abs(touch.N[1:, k]).max())
                says = f"the contact {contact.name} is left out"
                force = Difference(f"normal force of {contact.name}", "N", difference, TOUCHING_MOTION)
                yield force.cause("left out", says, remainder, "let the pair touch")


@hypothesis(
    "convex cone", "from the start of a slip each contact rises at μ|u|, as the convex dual of Coulomb's law lets it"
)
def convex_cone(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: sliding contacts hop; the first flight begins at the speed that makes impulse and slip orthogonal."""
    for touch in touch_of(evidence):
        t, size = touch.time, evidence.element.length
        part = (t[1] - t[0]) / (t[2] - t[1])
        slip = np.linalg.norm(touch.across[1] + part * (touch.across[1] - touch.across[2]), axis=-1)  # at take-off
        rises = touch.friction * slip
        which = (rises > SLIDES * evidence.element.speed) & (np.abs(touch.found.gap[0]) < _SUNK * size)
        if not which.any() or touch.presses[1:3, which].any():
            continue
        # a flight from a closed gap: gap = w t - a t²/2 and its rate w - a t
        began = 2 * touch.found.gap[1, which] / (t[1] - t[0]) - touch.u_n[1, which]
        says, remainder = "convex cone: the sliding contact hops at u_n = μ|u_t|", np.abs(began - rises[which]).max()
        speed = Difference("speed along the normal at the start", "m/s", float(rises[which].max()), TOUCHING_MOTION)
        yield speed.cause("convex cone", says, float(remainder), _UNCONVEX)


@hypothesis(
    "convex cone from rest", "contacts that start to slide rise at μ times the acceleration of their slip, at time 0"
)
def convex_cone_from_rest(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: first accelerations of contacts at rest are those that the convex dual of Coulomb's law allows."""
    mechanism, start = evidence.element.mechanism, evidence.element.start
    linear, angular = (evidence.vectors(name, len(start.v_WB[0])) for name in ("acceleration", "angular acceleration"))
    if start.v_WB.any() or start.w_WB.any() or not mechanism.contacts or linear is None or angular is None:
        return
    # accelerations of bodies at rest, as their velocities: contacts follow both alike
    of_run, of_scene = (
        follow_contacts(replace(start, v_WB=v[None], w_WB=w[None])) for v, w in zip(linear, angular, strict=True)
    )
    friction = np.array([contact.friction for contact in mechanism.contacts])
    rises, true = friction * of_run.slip[0], np.sum(of_scene.normal * of_scene.slide, axis=-1)[0]
    least = _SUNK * float(np.linalg.norm(mechanism.gravity))
    closed = np.abs(of_run.gap[0]) < _SUNK * evidence.element.length
    which = closed & (rises > least) & (friction * of_scene.slip[0] > least) & (np.abs(true) < _SUNK * rises)
    if which.any():
        rate = np.sum(of_run.normal * of_run.slide, axis=-1)[0, which]
        says = "convex cone: a body that starts to slide with the acceleration a rises with μa, and hops"
        name, difference = "acceleration along the normal at time 0", float(rises[which].max())
        remainder = float(np.abs(rate - rises[which]).max())
        yield Difference(name, "m/s^2", difference, TOUCHING_MOTION).cause("convex cone", says, remainder, _UNCONVEX)


@hypothesis("friction pyramid", "friction that turns lies on the sides of a square, |T1| + |T2| = μN, in every sample")
def pyramid(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: friction is bounded by a pyramid, whose axes are fitted by one angle, instead of a cone."""
    for touch in touch_of(evidence):
        sliding = touch.slides & (touch.friction > 0)
        if sliding.sum() > _FEW and not touch.has_true_friction(sliding):
            forces = touch.T[sliding], touch.against[sliding], (touch.friction * touch.N)[sliding]
            yield from _of_a_square(touch.found.normal[sliding], touch.across[sliding], *forces, evidence.element.force)


def _of_a_square(
    n: FloatArray, u: FloatArray, T: FloatArray, full: FloatArray, bound: FloatArray, least: float
) -> Iterator[Cause]:
    """Cause that friction is bounded by a square.

    Arrays over samples: normals, slips [m/s], friction T and Coulomb's friction ``full`` [N], (samples, 3); its size
    [N], (samples,). Differences below a small part of ``least``, a natural force [N], count as none.
    """
    if longest(n - n[0]) > FORCE:
        return
    e1 = np.eye(3)[np.argmin(np.abs(n[0]))]
    e1 = np.cross(n[0], e1) / np.linalg.norm(np.cross(n[0], e1))
    plane = np.array([e1, np.cross(n[0], e1)])
    turned_by = max(np.ptp(np.unwrap(np.arctan2(*(vectors @ plane.T).T[::-1]))) for vectors in (u, T))
    against = longest(T - full)
    if turned_by < _TURNS or against <= FORCE * least:
        return
    turned = np.array([[[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]] for a in _ANGLES])
    sides = np.abs(np.einsum("aij,kj->aki", turned, T @ plane.T)).sum(axis=-1)
    remainder = float(np.abs(sides - bound).max(axis=1).min())
    says = "friction pyramid: friction is bounded by a square about two axes, not by a circle"
    friction = Difference("friction of what slides", "N", against, TOUCHING_MOTION)
    yield friction.cause("pyramid", says, remainder, "choose the elliptic cone", 1)


@hypothesis("friction pyramid at time 0", "friction of what slides at time 0 lies on the sides of a square")
def pyramid_at_start(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: friction at time 0 is bounded by a pyramid."""
    element = evidence.element
    if (pair := forces_of_lines(evidence)) is None:
        return
    reported, _, finite = pair
    followed = follow_contacts(element.start)
    n, friction = followed.normal[0], np.array([contact.friction for contact in element.mechanism.contacts])
    friction = np.where(np.isinf(friction), 0.0, friction)
    N = np.sum(reported * n, axis=-1)
    slides = finite & (PRESSES * element.force < N) & (followed.slip[0] > SLIDES * element.speed) & (friction > 0)
    if slides.sum() >= _FEW:
        u = (followed.slide[0] - n * np.sum(n * followed.slide[0], axis=-1)[:, None])[slides]
        bound, T = (friction * N)[slides], (reported - N[:, None] * n)[slides]
        full = -u * (bound / followed.slip[0][slides])[:, None]
        yield from _of_a_square(n[slides], u, T, full, bound, element.force)


def forces_of_lines(evidence: Evidence) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]] | None:
    """Reported and true contact forces at time 0 [N], (contacts, 3), where they differ, and which are known."""
    pair = evidence.vectors(FORCES_AT_START, len(evidence.element.mechanism.contacts))
    if pair is None or evidence.read_back(FORCES_AT_START):
        return None
    reported, true = pair
    return reported, true, np.asarray(np.isfinite(reported).all(axis=-1) & np.isfinite(true).all(axis=-1))


@hypothesis(
    "creep", "contacts that stick in the truth slide at one speed times T/(μN), as a regularised friction lets them"
)
def creep(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: sticking contacts creep, as by a regularised law of friction."""
    for touch in touch_of(evidence) if "positions" not in evidence.settled else ():  # it explains no wrong force
        sticks = touch.presses & (touch.true.slip <= _HELD * evidence.element.speed) & (touch.friction > 0)
        slip = touch.found.slip[sticks]
        run, truth = evidence.run, evidence.truth
        assert run is not None
        assert truth is not None
        moved = float(np.abs(run["positions"].to_numpy() - truth["positions"].to_numpy()).max())
        if len(slip) < 4 or slip.max() * (touch.time[-1] - touch.time[0]) < moved:
            continue  # the creep alone cannot explain the error of the motion
        used = np.linalg.norm(touch.T[sticks], axis=-1) / (touch.friction * touch.N)[sticks]
        speed = float(np.sum(slip * used) / np.sum(used * used))
        says = f"contacts that stick creep at {speed:.3g} m/s times T/(μN): friction is regularised"
        remainder = float(np.abs(slip - speed * used).max())
        creeping = Difference("slip of what sticks", "m/s", float(slip.max()), TOUCHING_MOTION)
        yield creeping.cause("creep", says, remainder, "make that speed smaller", 1)


HYPOTHESES = (convex_cone, convex_cone_from_rest, pyramid, pyramid_at_start, friction_factor, left_out, creep)


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
