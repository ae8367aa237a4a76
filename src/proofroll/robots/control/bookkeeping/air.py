"""Robot in the air under a control law, moved by the steps of an engine: semi-implicit Euler or RK4."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.errors import Diverged
from proofroll.core.integrators import classical_step
from proofroll.elements.mechanism import BodyMotion, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates, Solution
from proofroll.elements.mechanism.dynamics.switches import held_joints
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.policy import Observation
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.robots.control.bookkeeping.law import ControlLaw, RobotState
from proofroll.robots.model import NO_BODY, Robot

# Treatments of gains: semi-implicit Euler with kd at the velocity before a step, or after it; RK4.
Treatment = Literal["explicit", "implicit", "rk4"]
TREATMENTS: tuple[Treatment, ...] = ("explicit", "implicit", "rk4")


class AirScheme(NamedTuple):
    """Steps of a program.

    Attributes:
        treatment: of gains.
        along_base: True if a floating base has its velocity along its own axes, not along the world's.
        damped: True if the joints' own damping acts at the velocity after the step.
    """

    treatment: Treatment = "explicit"
    along_base: bool = False
    damped: bool = False


_KINDS = itertools.product((False, True), (False, True), TREATMENTS[:2])
SCHEMES = (*(AirScheme(treatment, along_base, damped) for damped, along_base, treatment in _KINDS), AirScheme("rk4"))
_STOP = 1e6  # rad/s or m/s: a run that is faster has blown up


class AirLink(NamedTuple):
    """Link of a body; links at fixed joints make one body.

    Attributes:
        body: index of the body.
        mass: [kg].
        com: centre of mass in the body's frame [m], shape (3,).
        inertia: about it, in the body's axes [kg m²], shape (3, 3).
    """

    body: int
    mass: float
    com: Array
    inertia: Array


def links_of(robot: Robot) -> tuple[AirLink, ...]:
    """All links that move and have mass."""
    index = {joint.name: k for k, joint in enumerate(robot.moving)}
    links = []
    for name, (home, position, rotation) in robot.welded.items():
        if home != NO_BODY and (link := robot.bodies[name]).mass:
            com, inertia = position + rotation @ link.com, rotation @ link.inertia @ rotation.T
            links.append(AirLink(body=index[home], mass=link.mass, com=com, inertia=inertia))
    return tuple(links)


@dataclass(frozen=True)
class HeldRobot:
    """Robot in the air as a program holds it.

    Attributes:
        mechanism: the robot.
        links: the parts of its bodies.
        causes: ids of what makes it another one than that of the file.
        words: sentence on them, with what to do.
    """

    mechanism: Mechanism
    links: tuple[AirLink, ...]
    causes: tuple[str, ...] = ()
    words: str = ""

    @classmethod
    def of(cls, mechanism: Mechanism) -> HeldRobot:
        """Robot of a mechanism whose bodies are links."""
        links = (
            AirLink(body=k, mass=body.mass, com=np.array(body.com), inertia=np.array(body.inertia))
            for k, body in enumerate(mechanism.bodies)
        )
        return cls(mechanism, tuple(links))


class AirForces(NamedTuple):
    """Forces of a robot in the air in a state, along its velocities.

    Attributes:
        mass: mass matrix, (nv, nv).
        inertial: forces of inertia and of the joints' own laws, (nv).
        weight: (nv).
        free: directions that loops and couplings allow, (nv, freedoms).
        motion: of the bodies.
        pushes: of gravity of 1 m/s² along the world's axes, and of 1 N at the centre of each body, (1 + bodies, 3, nv).
    """

    mass: Array
    inertial: Array
    weight: Array
    free: Array
    motion: BodyMotion
    pushes: Array


class AirRobot:
    """Equations of a robot without its servos, and the places of joints in its coordinates.

    Attributes:
        mechanism: without actuators, with the armature of the law.
        equations: of it.
        joints: all joints with one coordinate, in the mechanism's order.
    """

    def __init__(self, mechanism: Mechanism, law: ControlLaw) -> None:
        armature = dict(zip(law.joints, law.armature.tolist(), strict=True))
        self.mechanism = replace(
            mechanism,
            actuators=tuple(item for item in mechanism.actuators if item.joint not in armature),
            control=None,
            joints=tuple(
                replace(joint, armature=armature.get(joint.name, joint.armature)) for joint in mechanism.joints
            ),
            gravity=tuple(law.gravity * np.array(mechanism.gravity)),
        )
        self.equations = JointCoordinates(self.mechanism)
        self.joints = tuple(joint.name for joint in mechanism.joints if joint.nq == 1)
        self.places = np.array([mechanism.place_of(name) for name in self.joints]).reshape(-1, 2)
        self.driven = np.array([mechanism.place_of(name) for name in law.joints])
        base = [k for k, joint in enumerate(mechanism.joints) if joint.kind == JointKind.FREE][:1]
        self.base = (mechanism.q_slices[base[0]], mechanism.v_slices[base[0]]) if base else None

    @classmethod
    def bare(cls, mechanism: Mechanism, law: ControlLaw) -> AirRobot:
        """Robot without the armature of a law, under the right gravity."""
        return cls(mechanism, law.change(armature=np.zeros(len(law.joints)), gravity=1.0))

    @cached_property
    def damping(self) -> Array:
        """Damping of the joints themselves along all velocities, (nv)."""
        damping = np.zeros(self.mechanism.nv)
        for joint, place in zip(self.mechanism.joints, self.mechanism.v_slices, strict=True):
            damping[place] = joint.damping
        return damping

    def solved(self, q: Array, v: Array, efforts: Array) -> Solution:
        """Accelerations under efforts of the joints [N m], where friction and stops hold joints at rest if they can."""
        joints, load = self.equations.switched, self.load(efforts)
        mode = [
            joint.moving(rate) if (rate := v[joint.velocity]) else joint.resting(q[joint.coordinate])
            for joint in joints
        ]
        while True:
            solution = self.equations.solve(q, v, tuple(mode), load)
            wanting = list(zip(held_joints(tuple(mode)), solution.holding, strict=True))
            bounds = {number: joints[number].bounds(mode[number]) for number, _ in wanting}
            beyond = [(k, force) for k, force in wanting if not bounds[k][0] <= force <= bounds[k][1]]
            if not beyond:
                acceleration = solution.acceleration.copy()
                acceleration[[joints[number].velocity for number in bounds]] = 0.0  # to the last digit, or it would rub
                return replace(solution, acceleration=acceleration)
            for number, force in beyond:
                mode[number] = joints[number].moving(-force)

    def forces(self, q: Array, v: Array) -> AirForces:
        """Forces of the robot in a state without efforts."""
        solution = self.equations.solve(q, v)
        J, M, _ = self.equations.inertial(solution.motion)
        pull = np.tensordot([body.mass for body in self.mechanism.bodies], J[:, :3], 1)
        pushes, weight = np.concatenate([pull[None], J[:, :3]]), np.array(self.mechanism.gravity) @ pull
        rank = self.equations.rank
        free = np.linalg.svd(solution.rows.C)[2][rank:].T if rank else np.eye(len(M))
        inertial = M @ solution.acceleration - weight
        return AirForces(mass=M, inertial=inertial, weight=weight, free=free, motion=solution.motion, pushes=pushes)

    def coordinates(self, q: Array, v: Array, base: Array | None) -> tuple[Array, Array]:
        """Coordinates and velocities of the mechanism.

        Args:
            q: coordinates of :attr:`joints`.
            v: their rates.
            base: place, quaternion, velocity and angular velocity in world axes, shape (13,); None: it is fixed.
        """
        whole_q, whole_v = np.zeros(self.mechanism.nq), np.zeros(self.mechanism.nv)
        whole_q[self.places[:, 0]], whole_v[self.places[:, 1]] = q, v
        if self.base is not None and base is not None:
            R = Rotation.from_quat(base[3:7], scalar_first=True).as_matrix()
            whole_q[self.base[0]] = base[:7]
            whole_v[self.base[1]] = np.concatenate([R.T @ base[7:10], R.T @ base[10:13]])
        return whole_q, whole_v

    def state(self, time: float, q: Array, v: Array) -> RobotState:
        """State of the driven joints and of the base, which is the world if it is fixed."""
        state = RobotState(time=time, q=q[self.driven[:, 0]], v=v[self.driven[:, 1]])
        if self.base is None:
            return state
        pose, twist = q[self.base[0]], v[self.base[1]]
        R = Rotation.from_quat(pose[3:], scalar_first=True).as_matrix()
        return replace(state, p_WB=pose[:3], q_WB=pose[3:], v_WB=R @ twist[:3], w_WB=R @ twist[3:])

    def load(self, efforts: Array) -> Array:
        """Efforts of the driven joints along all velocities; arrays have the joints, or the velocities, last."""
        load = np.zeros((*efforts.shape[:-1], self.mechanism.nv))
        load[..., self.driven[:, 1]] = efforts
        return load


@dataclass(frozen=True)
class AirStep:
    """Instant between two steps of a motion in the air.

    Attributes:
        q, v: coordinates and velocities of the mechanism, (nq) and (nv).
        efforts: of the driven joints, (n); those that act from here on.
        target: of the driven joints, (n).
        action: of the policy, (n); zeros without a policy.
        observation: of the policy, at an instant of the controller; None between.
    """

    q: Array
    v: Array
    efforts: Array
    target: Array
    action: Array
    observation: Observation | None


def steps_in_air(
    robot: AirRobot, law: ControlLaw, start: tuple[Array, Array], step: float, scheme: AirScheme
) -> Iterator[AirStep]:
    """Motion of a robot in the air without an end, at the first instant and after each step [s].

    Raises:
        InputError: the step does not divide the time between instants.
        Diverged: the motion blows up.
    """
    q, v = start
    period = law.period(step)
    answer, (last, waiting) = law.answer(), law.waiting()
    target, states, counts = law.pose.copy(), [robot.state(law.begins, q, v)], last
    efforts = np.zeros(len(law.joints))
    for k in itertools.count():
        time = law.begins + k * step
        state, observation = robot.state(time, q, v), None
        if k % period == 0:
            observation = law.observed(states[-1] if law.observed_lag else state, last)
            action = None if answer is None else answer(observation)
            last = last if action is None else action
            counts = counts if action is None else law.smoothed(action, counts)
            waiting.append(law.target(None if action is None else counts, time))
            target = waiting.pop(0)
        servo = states[-law.lag] if law.lag and len(states) >= law.lag else state
        if not law.hold_effort or k % period == 0:
            efforts = law.effort(target, servo.q, servo.v)
        yield AirStep(q=q, v=v, efforts=efforts, target=target, action=last, observation=observation)
        q, v = _stepped(robot, law, (q, v), (efforts, target), step, scheme)
        if not np.abs(v).max() < _STOP:
            raise Diverged(f"the motion blows up at t = {time:.4g} s")
        states = [*states[-1:], state]


def _stepped(
    robot: AirRobot,
    law: ControlLaw,
    state: tuple[Array, Array],
    acting: tuple[Array, Array],
    h: float,
    scheme: AirScheme,
) -> tuple[Array, Array]:
    """Coordinates and velocities after a step of ``h`` [s], for efforts at its begin and targets."""
    q, v = state
    efforts, target = acting
    if scheme.treatment == "rk4":
        return _rk4(robot, law, state, (efforts, target), h)
    acceleration = robot.solved(q, v, efforts).acceleration
    damping = robot.damping if scheme.damped else np.zeros(len(v))
    if scheme.treatment == "implicit":
        # What is clamped or held does not follow the velocity.
        free = (np.abs(efforts) < law.limit) & (not law.hold_effort)
        damping = damping + robot.load(np.where(free, law.kd, 0.0))
    if damping.any():
        M = robot.equations.inertial(robot.equations.tree.at(q, v))[1]
        acceleration = np.asarray(np.linalg.solve(M + h * np.diag(damping), M @ acceleration), float)
    return _moved(robot, q, v, acceleration, h, along_base=scheme.along_base)


def _moved(
    robot: AirRobot, q: Array, v: Array, acceleration: Array, h: float, *, along_base: bool
) -> tuple[Array, Array]:
    """State after a step of semi-implicit Euler, whose base has its velocity in world axes, or in its own."""
    new_v = v + h * acceleration
    new_q = robot.equations.tree.moved(q, h * new_v)
    if robot.base is not None:
        at_q, at_v = robot.base
        p, turned = q[at_q][:3], Rotation.from_quat(q[at_q][3:], scalar_first=True)
        R = turned.as_matrix()
        spin = new_v[at_v][3:]
        attitude = turned * Rotation.from_rotvec(h * spin)
        if along_base:  # it moves on a screw
            way = h * new_v[at_v][:3]
            turn = np.cross(h * spin, way)
            way = way + turn / 2 + np.cross(h * spin, turn) / 6
            new_q[at_q] = np.concatenate([p + R @ way, attitude.as_quat(scalar_first=True)])
            return new_q, new_v
        rate = acceleration[at_v][:3] + np.cross(v[at_v][3:], v[at_v][:3])
        velocity = R @ (v[at_v][:3] + h * rate)
        new_q[at_q] = np.concatenate([p + h * velocity, attitude.as_quat(scalar_first=True)])
        new_v[at_v] = np.concatenate([attitude.as_matrix().T @ velocity, spin])
    return new_q, new_v


def _rk4(
    robot: AirRobot, law: ControlLaw, state: tuple[Array, Array], acting: tuple[Array, Array], h: float
) -> tuple[Array, Array]:
    """State after a step of RK4, with targets held, or efforts."""
    start_efforts, target = acting
    nq = len(state[0])

    def rates(y: Array) -> Array:
        q, v = y[:nq], y[nq:]
        moving = law.effort(target, q[robot.driven[:, 0]], v[robot.driven[:, 1]])
        efforts = start_efforts if law.hold_effort else moving
        solution = robot.solved(q, v, efforts)
        return np.concatenate([robot.equations.tree.rate(q, v), solution.acceleration])

    y = classical_step(rates, np.concatenate(state), h)
    return robot.equations.tree.normalised(y[:nq]), y[nq:]
