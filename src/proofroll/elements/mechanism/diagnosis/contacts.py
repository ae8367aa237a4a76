"""Hypotheses of contacts: a wrong coefficient, a missing contact, another law of friction."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from proofroll.core.arrays import FloatArray, longest
from proofroll.core.diagnosis import METHOD, Cause, Difference, Evidence, hypothesis
from proofroll.core.diagnosis.fitting import cached_on_evidence, change_by, factor_text
from proofroll.core.diagnosis.samples import run_and_truth
from proofroll.elements.mechanism.diagnosis.equations import is_motion, placed_of
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.contacts.observables import (
    PRESSES,
    SLIDES,
    Followed,
    follow_contacts,
    normal_forces,
)
from proofroll.elements.mechanism.scene.model import Mechanism

# Least difference of forces and least overlap that point to another law, relative to the mechanism's force and size.
FORCE, _SUNK = 1e-4, 1e-3
_OFF = 1e-3  # largest factor of friction that counts as zero
_TURNS = 0.3  # rad: least turn of slip and friction that shows the shape of a cone
_FEW = 3  # samples of friction from which a square does not fit by chance
_ANGLES = np.linspace(0.0, np.pi / 2, 181)[:-1]
_UNCONVEX = "no step mends it: set cone_correction=true where the engine has it, or take Coulomb's own law"
_HELD = 1e-6  # slip speed of the truth that counts as sticking, relative to the mechanism's speed
FORCES_AT_START = "forces of contact"  # line of the certificate
# A wrong contact changes all of the motion, so that no further cause of the motion is looked for.
COVERS = ("motion", "contacts", "contact_forces", "normal_forces", "acceleration")


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
            friction = Difference("friction of what slides", "N", longest(T - full), COVERS, closes=METHOD)
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
                force = Difference(f"normal force of {contact.name}", "N", difference, COVERS)
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
        speed = Difference("speed along the normal at the start", "m/s", float(rises[which].max()), COVERS)
        yield speed.cause("convex cone", says, float(remainder), _UNCONVEX)


@hypothesis(
    "convex cone from rest", "contacts that start to slide rise at μ times the acceleration of their slip, at time 0"
)
def convex_cone_from_rest(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: first accelerations of contacts at rest are those that the convex dual of Coulomb's law allows."""
    mechanism, start = evidence.element.mechanism, evidence.element.start
    lines = {str(line["quantity"]): line for line in evidence.lines}
    names = ("acceleration", "angular acceleration")
    moves = max(float(np.abs(values).max(initial=0.0)) for values in (start.v_WB, start.w_WB))
    sizes = [np.size(lines[name][side]) for name in names if name in lines for side in ("found", "expected")]
    if moves > 0 or not mechanism.contacts or sizes != 4 * [start.v_WB.size]:
        return
    of_run, of_scene = (
        follow_contacts(replace(start, **_as_velocities(start, [lines[name][side] for name in names])))
        for side in ("found", "expected")
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
        yield Difference(name, "m/s^2", difference, COVERS).cause("convex cone", says, remainder, _UNCONVEX)


def _as_velocities(start: Placed, rates: list[FloatArray]) -> dict[str, FloatArray]:
    """Fields of a start whose velocities are these accelerations: of bodies at rest, contacts follow both alike."""
    linear, angular = (np.reshape(np.array(rate, dtype=np.float64), start.v_WB.shape) for rate in rates)
    return {"v_WB": linear, "w_WB": angular}


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
    friction = Difference("friction of what slides", "N", against, COVERS)
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
    line = next((line for line in evidence.lines if line["quantity"] == FORCES_AT_START), None)
    shape = (len(evidence.element.mechanism.contacts), 3)
    if line is None or line["holds"] or np.size(line["found"]) != np.prod(shape):
        return None
    reported, true = np.reshape(line["found"], shape), np.reshape(line["expected"], shape)
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
        creeping = Difference("slip of what sticks", "m/s", float(slip.max()), COVERS)
        yield creeping.cause("creep", says, remainder, "make that speed smaller", 1)


HYPOTHESES = (
    convex_cone,
    convex_cone_from_rest,
    pyramid,
    pyramid_at_start,
    friction_factor,
    left_out,
    creep,
)
