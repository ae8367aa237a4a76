"""Residuals of the equations of motion at the states of a run, without solving the equations.

The accelerations are derived from the run, or taken from the certificate. By d'Alembert's principle inertial and
applied forces must balance along every motion that joints and loops allow. This balance is linear in masses, inertias,
stiffnesses, damping and gravity, and needs no reactions.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Evidence
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.elements.mechanism.diagnosis.pressing import SCENES_LAW, ContactLimits, Pressing, Resisting, pressing
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion, Tree
from proofroll.elements.mechanism.dynamics.linear_balance import forces, moved, spun
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.dynamics.point_loads import PointLoad, applied_loads, bushing_loads, spring_loads
from proofroll.elements.mechanism.dynamics.switches import switched_joints
from proofroll.elements.mechanism.run.contacts.observables import follow_contacts
from proofroll.elements.mechanism.run.dataset import quaternions
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.joint_kinds import WITH_QUATERNION
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.parts import Spring
from proofroll.elements.mechanism.scene.signal import breaks, value_at

_FITS = ((7, 5), (5, 3))
_SAMPLES = 16
_DEPENDENT = 1e-7
_GONE = 1e-9
_TURNS = 0.1
_CONSISTENT = 1e-3
# Part of an error of places that an integral of velocities from few samples misses; least error that is looked at,
# relative to the mechanism's size; change of a velocity between samples, in usual changes, that counts as a jump.
_UNEXPLAINED, _LEAST_ERROR, _JUMPS = 0.7, 1e-6, 5.0
_AT_REST = 1e-9  # rate that counts as rest, relative to the coordinate's largest


@dataclass(frozen=True)
class MechanismState:
    """State of a mechanism at one instant of a run, with its kinematics and accelerations.

    Attributes:
        t: time [s].
        q, v: coordinates and velocities of the tree.
        motion: kinematics there.
        acceleration: of the origin of each body's frame, and turning, shape (bodies, 6).
    """

    t: float
    q: FloatArray
    v: FloatArray
    motion: BodyMotion
    acceleration: FloatArray

    @cached_property
    def columns(self) -> tuple[FloatArray, ...]:
        """Forces that numbers of bodies need by accelerations, by spin, for momenta, and by unit accelerations."""
        motion, (a, alpha) = self.motion, np.split(self.acceleration, 2, axis=1)
        R, w, v, J = motion.R_WB[:-1], motion.w_WB[:-1], motion.v_WB[:-1], motion.J[:-1]
        axes = np.repeat(np.eye(3)[:, None], len(R), axis=1)
        return moved(R, J, a, alpha), spun(R, J, w), moved(R, J, v, w), moved(R, J, axes, 0 * axes)


class MechanismStates:
    """States of a mechanism's tree: at samples of a run, or at the instant of its certificate.

    Attributes:
        each: the states.
        consistent: True if the tree allows the bodies' velocities in their poses, and contacts have one place each. If
            not, the reported motion is wrong, or its loads are not determinate, and no conclusion about the equations
            is possible.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        placed: Placed,
        acceleration: FloatArray,
        which: FloatArray,
        limits: ContactLimits | None = None,
        step: float = 0.0,
    ) -> None:
        self.mechanism, self.tree = mechanism, Tree(mechanism)
        self._limits, self._pressing = limits or ContactLimits.of(0.0, 0.0), dict[tuple[int, Resisting], Pressing]()
        coordinates, _ = placed.of_tree()
        self.each: list[MechanismState] = []
        self.consistent = True
        for i in which.tolist():
            q = coordinates[i]
            rest = self.tree.at(q, np.zeros(mechanism.nv))
            twists = np.concatenate([placed.v_WB[i], placed.w_WB[i]], axis=-1)
            v = np.linalg.lstsq(rest.J[:-1].reshape(-1, mechanism.nv), twists.ravel(), rcond=None)[0]
            off = np.abs(rest.J[:-1].reshape(-1, mechanism.nv) @ v - twists.ravel())
            # Velocities of a scheme of first order belong to the poses of up to a step before.
            aside = _CONSISTENT + step * float(np.max(np.abs(placed.w_WB[i]), initial=0.0))
            self.consistent &= bool(np.max(off) <= aside * max(float(np.max(np.abs(twists))), 1e-300))
            self.each.append(
                MechanismState(
                    t=float(placed.time[i]), q=q, v=v, motion=self.tree.at(q, v), acceleration=acceleration[i]
                )
            )
        self.consistent &= all(self.pressing(i, SCENES_LAW).determinate for i in range(len(self.each)))

    @cached_property
    def allowed(self) -> list[FloatArray]:
        """Directions along which loops, couplings and contacts do no unknown work, (nv, directions), at each state."""
        return [self.free(i, ()) for i in range(len(self.each))]

    def pressing(self, i: int, law: Resisting) -> Pressing:
        """Loads of contacts at one state, with a law of rolling resistance."""
        if (i, law) not in self._pressing:
            self._pressing[i, law] = pressing(self.mechanism, self.each[i].motion, self._limits, law)
        return self._pressing[i, law]

    def free(self, i: int, without: tuple[int, ...], law: Resisting = SCENES_LAW) -> FloatArray:
        """Directions of velocity along which no unknown force works at one state, (nv, directions).

        ``without``: rows of loops that are left out; ``law``: of rolling resistance.
        """
        rows = self.tree.loop_rows(self.each[i].motion)
        C = np.concatenate([np.delete(rows.C, without, axis=0), self.coupled, self.pressing(i, law).unknown])
        if not len(C):
            return np.eye(self.mechanism.nv)
        _, S, Vt = np.linalg.svd(C)
        return Vt[int(np.sum(_DEPENDENT * S[0] < S)) :].T

    @cached_property
    def coupled(self) -> FloatArray:
        """Rows of the couplings on the velocities, (couplings, nv)."""
        rows = np.zeros((len(self.mechanism.couplings), self.mechanism.nv))
        for row, coupling in zip(rows, self.mechanism.couplings, strict=True):
            for name, factor in coupling.terms:
                row[self.mechanism.place_of(name)[1]] = factor
        return rows

    @cached_property
    def v_rates(self) -> list[FloatArray]:
        """Accelerations along the tree's velocities, (nv), at each state."""
        rates: list[FloatArray] = []
        for state in self.each:
            J = state.motion.J[:-1].reshape(-1, self.mechanism.nv)
            off = (state.acceleration - state.motion.bias[:-1]).ravel()
            rates.append(np.asarray(np.linalg.lstsq(J, off, rcond=None)[0], dtype=np.float64))
        return rates

    @cached_property
    def scale(self) -> FloatArray:
        """Scale of the balance along each velocity, (nv): its largest inertia or load.

        Velocities of a ball joint or free body share one scale, for about an axis of symmetry only round-off may be
        left.
        """
        sizes = self._own[:, :2].reshape(-1, self.mechanism.nv)
        largest = np.max(np.abs(sizes), axis=0, initial=0.0)
        for joint, part in zip(self.mechanism.joints, self.mechanism.v_slices, strict=True):
            if joint.kind in WITH_QUATERNION:  # about an axis of symmetry there may be round-off alone
                vectors = largest[part].reshape(-1, 3)
                vectors[:] = np.max(vectors, axis=1, keepdims=True)
        return np.where(largest > 1e-9 * np.max(largest), largest, np.max(largest) or 1.0)

    def parts(self, change: Change) -> FloatArray:
        """Inertia, loads and the sum of sizes of their terms, along each velocity at each state, (states, 3, nv)."""
        return np.array([change.balance(self, i) for i in range(len(self.each))])

    def left(self, change: Change, without: tuple[int, ...] = ()) -> FloatArray:
        """Relative residuals of the balance along the allowed motions, all states in one vector.

        Where a change removes all inertia and loads of a velocity, and loads no other one that had no load, the
        unchanged mechanism's residual stands there: an empty balance proves nothing.
        """
        residuals, parts, plain = [], self.parts(change), self._own
        gone = np.max(parts[:, 2], axis=0) <= _GONE * np.max(plain[:, 2], axis=0)
        loads, plain_loads = (np.max(np.abs(values[:, 1]), axis=0) for values in (parts, plain))
        gone &= not np.any((loads > 0) & (plain_loads <= _GONE * loads))
        balance = np.where(gone, plain[:, 0] - plain[:, 1], parts[:, 0] - parts[:, 1])
        for i, row in enumerate(balance):
            as_built = not without and change.resisting == SCENES_LAW
            directions = self.allowed[i] if as_built else self.free(i, without, change.resisting)
            residuals.append(directions.T @ row / (np.abs(directions.T) @ self.scale))
        return np.concatenate(residuals)

    @cached_property
    def _own(self) -> FloatArray:
        """Terms of the unchanged mechanism, see :meth:`parts`."""
        return self.parts(Change(self.mechanism))


@dataclass(frozen=True)
class Change:
    """Changed numbers of a mechanism with which an engine may move it.

    Attributes:
        mechanism: bodies and joints.
        mass, com, inertia: of the bodies; None: the mechanism's.
        gravity: [m/s²].
        damping, stiffness, torque, armature: factors on those of the joints.
        bushings: factor on the loads of bushings.
        springs, spring_damping: factors on stiffness and damping of the springs.
        weight_at_origin: True if weights act at the origins of the bodies' frames.
        added_damping, added_armature: additional damping and armature along each velocity of the tree, (nv).
        friction: factor on the dry friction of moving joints, of all or along each velocity, (nv).
        effort: effort of an actuator as a function of itself, time, coordinate and rate.
        gyroscopic: factor on ω × I ω.
        factors_of_forces: factors on some of the applied forces, by their index.
        coupling: mask of entries of the mass matrix that are lost, (nv, nv).
        decay: rates at which linear and angular momenta of all bodies are damped [1/s].
        resisting: law of rolling resistance.
    """

    mechanism: Mechanism
    mass: FloatArray | None = None
    com: FloatArray | None = None
    inertia: FloatArray | None = None
    gravity: FloatArray | None = None
    damping: float = 1.0
    stiffness: float = 1.0
    torque: float = 1.0
    armature: float = 1.0
    bushings: float = 1.0
    springs: float = 1.0
    spring_damping: float = 1.0
    weight_at_origin: bool = False
    added_damping: FloatArray | float = 0.0
    added_armature: FloatArray | float = 0.0
    friction: FloatArray | float = 1.0
    effort: Callable[[Actuator, float, float, float], float] = Actuator.effort
    gyroscopic: float = 1.0
    factors_of_forces: tuple[tuple[int, float], ...] = ()
    coupling: FloatArray | None = None
    decay: tuple[float, float] = (0.0, 0.0)
    resisting: Resisting = SCENES_LAW

    def balance(self, states: MechanismStates, i: int) -> FloatArray:
        """Inertial forces, applied forces, and the sum of sizes of their terms, along each velocity, (3, nv)."""
        m, state, mechanism = states.mechanism, states.each[i], self.mechanism
        mass, com, inertia = (
            np.array([getattr(body, name) for body in mechanism.bodies]) if value is None else value
            for name, value in (("mass", self.mass), ("com", self.com), ("inertia", self.inertia))
        )
        g = np.array(mechanism.gravity) if self.gravity is None else self.gravity
        origin, none, rate = 0 * com, 0 * mass, states.v_rates[i]
        by_acceleration, by_spin, momenta, by_axes = state.columns
        terms = [forces(by_acceleration + by_spin, mass, com), forces(by_acceleration, none, com, inertia)]
        terms.append(self.gyroscopic * forces(by_spin, none, com, inertia))
        by_v = [joint for joint in mechanism.joints for _ in range(joint.nv)]
        terms.append((self.armature * np.array([j.armature for j in by_v]) + self.added_armature) * rate)
        if self.coupling is not None:
            M = JointCoordinates(mechanism, rank=0).inertial(state.motion)[1]
            terms.append(-(M * self.coupling) @ rate)
        acts = g @ forces(by_axes, mass, origin if self.weight_at_origin else com)
        acts = acts + self.torque * np.array([float(value_at(j.torque, state.t)) for j in by_v])
        acts = acts - self.friction * np.array([j.friction for j in by_v]) * np.sign(state.v)
        acts = acts - self.decay[0] * forces(momenta, mass, com) - self.decay[1] * forces(momenta, none, com, inertia)
        acts = acts + states.pressing(i, self.resisting).known
        for actuator in mechanism.actuators:
            at_one, rated = m.place_of(actuator.joint)
            acts[rated] += self.effort(actuator, state.t, float(state.q[at_one]), float(state.v[rated]))
        acts = acts - (self.damping * np.array([j.damping for j in by_v]) + self.added_damping) * state.v
        for joint, at_q, at_v in zip(mechanism.joints, m.q_slices, m.v_slices, strict=True):
            if joint.stiffness:
                acts[at_v] -= self.stiffness * joint.stiffness * (state.q[at_q] - joint.rest)
        for factor, load in self._point_loads(state):
            acts = acts + factor * load.along(state.motion)
        return np.array([sum(terms), acts, sum(map(np.abs, terms)) + np.abs(acts)])

    def _point_loads(self, state: MechanismState) -> Iterator[tuple[float, PointLoad]]:
        """Loads of springs, bushings and applied forces, each with its factor."""
        mechanism, motion, factors = self.mechanism, state.motion, dict(self.factors_of_forces)

        def pull(spring: Spring, length: float, rate: float) -> float:
            damped = spring.damping * rate
            return float(self.springs * (spring.pull(length, rate) - damped) + self.spring_damping * damped)

        yield from ((1.0, load) for load in spring_loads(mechanism, motion, pull))
        yield from ((self.bushings, load) for load in bushing_loads(mechanism, motion))
        for number, applied in enumerate(mechanism.forces):
            factor = factors.get(number, 1.0)
            yield from ((factor, load) for load in applied_loads(mechanism, applied, motion, state.t))


def placed_of(mechanism: Mechanism, dataset: Any) -> Placed:
    """Motion of the bodies of a run."""
    time, p_WB, v_WB, w_WB = (dataset[name].to_numpy() for name in ("time", "p_WB", "v_WB", "w_WB"))
    return Placed(mechanism, time, p_WB=p_WB, v_WB=v_WB, w_WB=w_WB, q_WB=quaternions(dataset))


def is_motion(dataset: Any) -> bool:
    """True if all poses and velocities of a run are finite, and its quaternions are rotations."""
    parts = [*(dataset[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB")), quaternions(dataset)]
    return all(np.all(np.isfinite(part)) for part in parts) and bool(
        np.all(np.linalg.norm(parts[-1], axis=-1) > _TURNS)
    )


def is_one_motion(run: Any, truth: Any, length: float, step: float = 0.0) -> bool:
    """False if errors of places are none that errors of velocities make: the report is wrong then, and no law.

    Intervals in which a velocity jumps are left out. A scheme of first order moves places by velocities of up to a step
    away, and soft joints move origins that they hold by a small part of what the bodies are off. ``length``: size of
    the mechanism [m]; ``step``: of the engine [s].
    """
    count = min(dataset.sizes["time"] for dataset in (run, truth))
    h = np.diff(truth["time"].to_numpy()[:count])[:, None]
    (p, v), (true_p, true_v) = (
        [dataset[name].to_numpy()[:count].reshape(count, -1) for name in ("p_WB", "v_WB")] for dataset in (run, truth)
    )
    smooth = np.ones(len(h), dtype=bool)
    for velocities in (v, true_v):
        changes = np.max(np.abs(np.diff(velocities, axis=0)), axis=1)
        smooth &= changes <= _JUMPS * np.median(changes)
    off, rate = p - true_p, v - true_v
    chords = [np.linalg.norm(quaternions(run)[:count] - sign * quaternions(truth)[:count], axis=-1) for sign in (1, -1)]
    farthest = max(float(np.max(np.abs(off))), 2 * length * float(np.max(np.minimum(*chords))))
    unexplained = np.cumsum((np.diff(off, axis=0) - h * (rate[1:] + rate[:-1]) / 2)[smooth], axis=0)
    least = max(_UNEXPLAINED * farthest, _LEAST_ERROR * length, step * float(np.max(np.ptp(v, axis=0))))
    return float(np.max(np.abs(unexplained), initial=0.0)) <= least


def limits_of(element: Any) -> ContactLimits:
    """Limits between the states of an element's contacts."""
    return ContactLimits.of(element.length, element.speed)


def _modes(element: Any, placed: Placed) -> list[tuple[object, ...]]:
    """Mode of the switching laws at each sample: friction and stops, limited efforts, sections of tables, contacts."""
    mechanism, limits = element.mechanism, limits_of(element)
    followed = follow_contacts(placed)
    touching = [
        tuple(map(limits.kind, mechanism.contacts, gaps, slips))
        for gaps, slips in zip(followed.gap.tolist(), followed.slip.tolist(), strict=True)
    ]
    corners = np.array(breaks(mechanism.signals))
    modes: list[tuple[object, ...]] = []
    joints = switched_joints(mechanism)
    q, v = placed.of_tree() if joints or mechanism.actuators else (np.zeros((len(placed.time), mechanism.nq)),) * 2
    least = _AT_REST * np.max(np.abs(v), axis=0, initial=0.0)
    for t, places, rates, touched in zip(placed.time.tolist(), q, v, touching, strict=True):
        rest = tuple(
            (
                np.sign(rates[j.velocity]) if abs(rates[j.velocity]) > least[j.velocity] else 0.0,
                j.low < places[j.coordinate] < j.high,
            )
            for j in joints
        )
        limited = ((item, *mechanism.place_of(item.joint)) for item in mechanism.actuators if item.limit is not None)
        efforts = tuple(item.mode(t, float(places[place]), float(rates[rated])) for item, place, rated in limited)
        modes.append((rest, efforts, int(np.searchsorted(corners, t)), touched))
    return modes


def _moves(mode: tuple[object, ...]) -> bool:
    """True if every switched joint moves and is away from its stops."""
    rest: Any = mode[0]
    return all(direction and inside for direction, inside in rest)


def stretch(element: Any, *datasets: Any) -> slice | None:
    """Longest stretch of samples in which no run of an element switches and no joint is held.

    None: there are too few samples, or a run has values that are not finite.
    """
    if not all(is_motion(dataset) for dataset in datasets):
        return None
    count = min(dataset.sizes["time"] for dataset in datasets)
    placed = (placed_of(element.mechanism, dataset) for dataset in datasets)
    modes = list(zip(*(_modes(element, motion) for motion in placed), strict=False))
    ends = [0, *(k for k in range(1, count) if modes[k] != modes[k - 1]), count]
    free = [slice(a, b) for a, b in itertools.pairwise(ends) if all(map(_moves, modes[a]))]
    longest = max(free, key=lambda part: part.stop - part.start, default=slice(0, 0))
    return longest if _fit(longest) else None


def _fit(part: slice) -> tuple[int, int] | None:
    """Degree of the splines through a stretch, and samples to leave out at each end; None: it is too short."""
    return next(((degree, ends) for degree, ends in _FITS if part.stop - part.start > degree + 2 * ends), None)


def of_run(element: Any, dataset: Any, part: slice, ahead: float = 0.0, step: float = 0.0) -> MechanismStates:
    """States of a run of an element at some samples of a stretch, away from its ends.

    ``ahead``: time by which the accelerations are those of later [s]; ``step``: of the engine [s].
    """
    mechanism = element.mechanism
    placed = placed_of(mechanism, dataset)
    twists = np.concatenate([placed.v_WB, placed.w_WB], axis=-1)
    acceleration = np.zeros_like(twists)
    time, fit = placed.time[part], _fit(part)
    assert fit is not None  # :func:`stretch` returns only stretches that are long enough
    degree, ends = fit
    later = np.minimum(time + ahead, time[-1])
    acceleration[part] = make_interp_spline(time, twists[part], k=degree).derivative()(later)
    which = np.unique(np.linspace(part.start + ends, part.stop - 1 - ends, _SAMPLES).astype(int))
    return MechanismStates(mechanism, placed, acceleration, which, limits_of(element), step)


def of_start(evidence: Evidence, derived: bool = False) -> MechanismStates | None:
    """State at the start with the accelerations of the certificate; None if it has none, or a joint is held.

    Accelerations are those that the engine reports, or else those of its first steps; if ``derived``, only the latter.
    """
    element = evidence.element
    if not _moves(_modes(element, element.start)[0]):
        return None
    rows = []
    for name in ("acceleration", "angular acceleration"):
        pairs = (evidence.vectors(name + when, len(element.bodies)) for when in ("", OF_FIRST_STEPS)[derived:])
        rates = [pair[0] for pair in pairs if pair is not None and np.all(np.isfinite(pair[0]))]
        if not rates:
            return None
        rows.append(rates[0])
    accelerations = np.concatenate(rows, axis=-1)[None]
    return MechanismStates(element.mechanism, element.start, accelerations, np.zeros(1, dtype=int), limits_of(element))
