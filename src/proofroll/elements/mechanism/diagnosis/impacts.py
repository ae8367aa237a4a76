"""Hypotheses of impacts: they come late, or have another restitution or friction."""

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES, Cause, Difference, Evidence, hypothesis
from proofroll.core.diagnosis.fitting import (
    ABOVE,
    CauseRow,
    Residuals,
    change_by,
    factor_text,
    least_squares_parameters,
)
from proofroll.core.diagnosis.vectors import delay_text
from proofroll.core.errors import InputError, NotUnique
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.diagnosis.contacts import touch_of
from proofroll.elements.mechanism.diagnosis.equations import is_one_motion, placed_of
from proofroll.elements.mechanism.diagnosis.residuals import TOUCHING_MOTION
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.contacts.observables import PRESSES, Followed, normal_forces
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry

_DELAY, _RATIO = 0.05, 1e-3  # largest delay, in steps, and error of restitution that count as none
_JUMP = 1e-4  # least velocity that counts as missed, relative to the mechanism's speed
_NO_JUMP = 1e-6  # of the origins of bodies beside that of the gap's rate: round-off
_ROUNDS = 4
_CONTRACTIONS = 20  # until slip and speed along the normal fit each other
_REMEDY = "look at the value that the engine uses"
_EXACT = 1e-3  # part of the difference at impacts that no error of a step leaves by chance
_REAL = 1e-9  # imaginary part of a real root, in intervals of samples
# If a gap has a cubic term, and its parabola misses by m one interval T back, it misses by 5 m one interval ahead, and
# its rate there by 12 m / T.
_OFF, _OFF_RATE = 5.0, 12.0


@hypothesis(
    "impacts", "the flights before and after an impact, extended until they meet, give its time and its restitution"
)
def impacts(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: impacts come late, or with the restitution of another pair."""
    for touch in touch_of(evidence):
        law = [contact.restitution for contact in touch.mechanism.contacts]
        names = [contact.name for contact in touch.mechanism.contacts]
        met = [
            (k, impact)
            for k in range(len(law))
            for impact in _met(touch.time, touch.found.gap[:, k], touch.u_n[:, k], ~touch.presses[:, k])
        ]
        if not met:
            continue
        delays, delay_bars, seen, seen_bars = np.array([impact[2:] for _, impact in met]).T
        size = float(np.abs(delays).max())
        if evidence.step and size > _DELAY * evidence.step:
            steps = np.round(2 * np.mean(delays) / evidence.step) / 2
            says = f"impacts come {delay_text(float(np.mean(delays)), evidence.step)}"
            remainder = float(np.max(np.abs(delays - steps * evidence.step) + delay_bars))
            remedy = "let the impact act in the step in which the gap closes"
            closes = CLOSES * min(1.0, evidence.step / size)  # any delay is near some multiple of half a step
            late = Difference("time of impacts", "s", size, TOUCHING_MOTION, closes=closes)
            yield late.cause("late impact", says, remainder, remedy, 1, explains=len(met))
        coefficients = np.array([law[k] for k, _ in met])
        difference = float(np.abs(seen - coefficients).max())
        if not _RATIO < difference < np.inf:
            continue
        restitution, of_each = Difference("restitution", "1", difference, TOUCHING_MOTION), sorted({k for k, _ in met})
        off = np.abs(seen - np.array([law[k] for k in of_each])[:, None]) + seen_bars
        off = np.array([off[:, [k == pair for k, _ in met]].max(axis=1) for pair in of_each])
        moved = linear_sum_assignment(off)[1].tolist()
        remainder = float(off[range(len(off)), moved].max())
        swaps = "; ".join(f"{names[of_each[a]]} has that of {names[of_each[b]]}" for a, b in enumerate(moved) if a != b)
        says = f"restitution is of another pair: {swaps}"
        yield restitution.cause("restitution", says, remainder, "give each pair its own")
        factor = float(seen @ coefficients / (coefficients @ coefficients)) if coefficients.any() else np.nan
        says = f"restitution of all pairs is {factor_text(factor)}"
        remainder = float(np.max(np.abs(seen - factor * coefficients) + seen_bars))
        change = change_by(factor)
        yield restitution.cause("restitution", says, remainder, _REMEDY, 1, explains=len(met), change=change)


class _Impact(NamedTuple):
    """An impact of one contact between two flights.

    Attributes:
        k: last sample before it.
        time: instant at which the flights meet [s].
        delay, delay_bar: of that after the gap closes [s].
        restitution, restitution_bar: of the gap's rate.
    """

    k: int
    time: float
    delay: float
    delay_bar: float
    restitution: float
    restitution_bar: float


def _met(t: FloatArray, gap: FloatArray, rate: FloatArray, free: Any) -> Iterator[_Impact]:
    """Impacts of a contact between two flights, ``free`` of forces.

    A flight is a parabola through two samples; its misfit at a third sample gives the error bars.
    """
    for k in range(1, len(t) - 2):
        if not (free[k - 1 : k + 3].all() and rate[k] < 0 < rate[k + 1]):
            continue
        flights, off, off_rate = [], 0.0, 0.0
        for index, next_k in ((k, k - 1), (k + 1, k + 2)):
            a, since = (rate[index] - rate[next_k]) / (t[index] - t[next_k]), t[next_k] - t[index]
            flights.append(
                np.poly1d(
                    [a / 2, rate[index] - a * t[index], gap[index] - rate[index] * t[index] + a * t[index] ** 2 / 2]
                )
            )
            misfit = abs(gap[index] + rate[index] * since + a * since**2 / 2 - gap[next_k])
            off, off_rate = off + _OFF * misfit, off_rate + _OFF_RATE * misfit / abs(since)
        flight_in, flight_out = flights
        real = _REAL * (t[k + 1] - t[k])
        closes = [r.real for r in flight_in.roots if abs(r.imag) < real and t[k] <= r.real <= 2 * t[k + 1] - t[k]]
        meets = [r.real for r in (flight_in - flight_out).roots if abs(r.imag) < real and t[k] <= r.real <= t[k + 1]]
        if closes and meets:
            when = min(meets, key=lambda index: abs(index - min(closes)))
            fell, rose = flight_in.deriv()(when), flight_out.deriv()(when)
            bars = off / abs(fell), off_rate / abs(fell)
            yield _Impact(
                k=k,
                time=when,
                delay=when - min(closes),
                delay_bar=bars[0],
                restitution=float(-rose / fell),
                restitution_bar=bars[1],
            )


@dataclass(frozen=True)
class _Struck:
    """A mechanism at an impact of one contact.

    Attributes:
        contact: its number.
        q: coordinates.
        before, after: velocities, (nv).
        root: of the inertia over the whole mass, (nv, nv): makes of velocities those of the whole mass.
    """

    contact: int
    q: FloatArray
    before: FloatArray
    after: FloatArray
    root: FloatArray


@hypothesis(
    "laws of impacts",
    "with a convex cone, a factor on one law of all pairs or a turned plane, velocities before impacts give all after",
)
def laws_of_impacts(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: an engine scales the friction or restitution of impacts, uses a convex cone, or turns a plane."""
    for touch in touch_of(evidence) if not evidence.by_step else ():
        if not is_one_motion(evidence.run, evidence.truth, evidence.element.length):
            return
        mechanism, least = touch.mechanism, evidence.element.force
        true_presses = np.asarray(PRESSES * least < normal_forces(touch.true, touch.true_force))
        seen = list(_struck(mechanism, evidence.run, touch.found, touch.presses))
        true = list(_struck(mechanism, evidence.truth, touch.true, true_presses))
        true_error = float(np.max(np.abs(_missed(mechanism, true)), initial=0.0))
        difference = float(np.max(np.abs(_missed(mechanism, seen)), initial=0.0))
        if not max(_JUMP * evidence.element.speed, ABOVE * true_error) < difference < np.inf:
            continue
        residuals = Residuals(
            functools.partial(_missed, impacts=seen),
            *("velocities after impacts", "m/s", difference, CLOSES, TOUCHING_MOTION, mechanism),
            functools.partial(_others, mechanism),
        )
        says, remedy = "convex cone: contacts part after an impact by μ|u_t| too fast", "take Coulomb's own law"
        remainder = float(np.max(np.abs(_missed(mechanism, seen, convex=True))))
        velocities = Difference(residuals.quantity, residuals.unit, difference, TOUCHING_MOTION)
        yield velocities.cause("convex cone", says, remainder, remedy)
        for law in ("friction", "restitution"):
            factor = residuals.fit(functools.partial(_scaled, mechanism, law), 1.0)
            model, says = _scaled(mechanism, law, factor), f"{law} of impacts is {factor_text(factor)}"
            yield residuals.cause(
                CauseRow(f"{law} of impacts", says, model, _REMEDY, fitted=1, change=change_by(factor))
            )
        for plane in (geometry for geometry in mechanism.geometries if geometry.kind == "plane"):

            def missed(by: FloatArray, plane: Geometry = plane, source: Residuals[Mechanism] = residuals) -> FloatArray:
                return source.left(_with_turned_plane(source.plain, plane, by))

            by = least_squares_parameters(missed, np.zeros(2), 1.0)
            remainder, off = float(np.max(np.abs(missed(by)))), float(np.linalg.norm(by))
            says, remedy = f"the normal of {plane.name} is turned by {off:.4g} rad", "look at the axes of geometries"
            explains = int(np.sum(np.abs(missed(np.zeros(2))) > CLOSES * difference))
            change = np.inf if remainder <= _EXACT * difference else off
            yield velocities.cause("normal of a plane", says, remainder, remedy, 2, explains=explains, change=change)


def _struck(mechanism: Mechanism, dataset: Any, followed: Followed, presses: Any) -> Iterator[_Struck]:
    """Impacts of a run, or of the truth, while no other contact presses."""
    placed, dynamics = placed_of(mechanism, dataset), ContactDynamics(mechanism)
    mass = sum(body.mass for body in mechanism.bodies)
    t, w, u_n = placed.time, placed.w_WB, np.sum(followed.normal * followed.slide, axis=-1)
    for contact in range(followed.gap.shape[1]):
        for impact in _met(t, followed.gap[:, contact], u_n[:, contact], ~presses[:, contact]):
            k = impact.k
            others = np.delete(u_n[k : k + 2], contact, axis=1)
            if presses[k - 1 : k + 3].any() or ((others[0] < 0) & (others[1] > 0)).any():
                continue
            time, gaps, rates = impact.time, followed.gap[:, contact], u_n[:, contact]
            for _ in range(_ROUNDS):  # Gauss-Newton: bodies are in one place, and their velocities jump
                (p, v), (p_after, v_after) = (
                    _extrapolated(t, placed.p_WB, placed.v_WB, i, j, time) for i, j in ((k, k - 1), (k + 1, k + 2))
                )
                (gap, rate), (gap_after, rate_after) = (
                    _extrapolated(t, gaps, rates, i, j, time) for i, j in ((k, k - 1), (k + 1, k + 2))
                )
                apart, jump = p - p_after, v - v_after
                if np.abs(jump).max() <= _NO_JUMP * abs(rate - rate_after):  # bodies that turn about their origins
                    apart, jump = gap - gap_after, rate - rate_after
                time -= float(np.sum(apart * jump) / np.sum(jump**2))
            spins = [w[i] + (w[i] - w[j]) / (t[i] - t[j]) * (time - t[i]) for i, j in ((k, k - 1), (k + 1, k + 2))]
            R = Rotation.from_rotvec((time - t[k]) * (w[k] + spins[0]) / 2) * Rotation.from_matrix(placed.R_WB[k, :-1])
            turns = np.roll(R.as_quat(), 1, axis=-1)
            (q, v_in), (_, v_out) = (
                Placed(
                    mechanism=mechanism,
                    time=np.array([time]),
                    p_WB=p[None],
                    v_WB=velocity[None],
                    w_WB=spin[None],
                    q_WB=turns[None],
                ).of_tree()
                for velocity, spin in zip((v, v_after), spins, strict=True)
            )
            root = np.linalg.cholesky(dynamics.at(q[0], v_in[0]).mass).T / np.sqrt(mass)
            yield _Struck(contact=contact, q=q[0], before=v_in[0], after=v_out[0], root=root)


def _extrapolated(
    t: FloatArray, p: FloatArray, v: FloatArray, i: int, j: int, time: float
) -> tuple[FloatArray, FloatArray]:
    """Places and velocities at a time, by parabolas from sample i whose curvature is that between samples i and j."""
    a, since = (v[i] - v[j]) / (t[i] - t[j]), time - t[i]
    return p[i] + v[i] * since + a * since**2 / 2, v[i] + a * since


def _missed(model: Mechanism | None, impacts: Sequence[_Struck], convex: bool = False) -> FloatArray:
    """Velocities after impacts less those of a model, as of the whole mass with that kinetic energy [m/s].

    ``convex``: with a convex cone of friction, contacts part faster than by their restitution, by μ times their slip.
    Infinite without a model, and where it leaves the outcome of an impact open.
    """
    if model is None:
        return np.full(1, np.inf)
    dynamics, parts = ContactDynamics(model), [np.zeros(0)]
    for impact in impacts:
        contact, state = dynamics.contacts[impact.contact], dynamics.at(impact.q, impact.before)
        if convex and np.isinf(contact.friction):  # such a cone parts whatever it meets at once
            return np.full(1, np.inf)
        n, J = state.touching[impact.contact].normal, state.J[impact.contact]
        comes, slip = abs(float(n @ J @ impact.before)), 0.0
        for _ in range(_CONTRACTIONS if convex else 1):
            e = np.array([contact.restitution + (contact.friction * slip / comes if slip else 0.0)])
            try:
                v_out, _, _ = dynamics.struck(impact.q, impact.before, [impact.contact], e, margin=False)
            except NotUnique:
                return np.full(1, np.inf)
            slip = float(np.linalg.norm(np.cross(n, J @ v_out)))
        parts.append(impact.root @ (impact.after - v_out))
    return np.concatenate(parts)


def _scaled(mechanism: Mechanism, law: str, factor: float) -> Mechanism | None:
    """A mechanism with a factor on the friction or restitution of all pairs; None: no pair can have that."""
    try:
        return replace(mechanism, pairs=tuple(replace(p, **{law: factor * getattr(p, law)}) for p in mechanism.pairs))
    except InputError:
        return None


def _with_turned_plane(mechanism: Mechanism, plane: Geometry, by: FloatArray) -> Mechanism:
    """A mechanism with the normal of a plane turned towards its two axes [rad]."""
    normal = tuple((plane.frame[:, 2] + plane.frame[:, :2] @ by).tolist())
    others = (replace(g, normal=normal) if g is plane else g for g in mechanism.geometries)
    return replace(mechanism, geometries=tuple(others))


def _others(mechanism: Mechanism) -> list[Mechanism]:
    """Mechanisms with one number of all pairs, or of one body, halved."""
    halved = [replace(mechanism, pairs=tuple(replace(p, **{law: getattr(p, law) / 2}) for p in mechanism.pairs))
              for law in ("friction", "restitution")]  # fmt: skip
    for k, body in enumerate(mechanism.bodies):
        inertia: Any = np.asarray(body.inertia) / 2
        for body_changed in (replace(body, mass=body.mass / 2), replace(body, inertia=inertia)):
            halved.append(replace(mechanism, bodies=(*mechanism.bodies[:k], body_changed, *mechanism.bodies[k + 1 :])))
    return halved
