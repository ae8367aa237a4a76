"""A mechanism as a multibody from PyBullet's importer of URDF, with loops as point-to-point constraints.

PyBullet returns poses of links in single precision, so poses of bodies are computed from the joints' coordinates, which
it returns in double precision.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from proofroll.adapter import (
    WORLD,
    Body,
    Diverged,
    Joint,
    Mechanism,
    MechanismBuilt,
    MechanismCapability,
    MechanismSample,
    Refused,
    Regularised,
    Scene,
    Tree,
    from_quaternion,
    held_points,
    mechanism_of,
    to_quaternion,
    value_at,
    whole_steps,
)
from proofroll_pybullet.settings import PybulletSettings
from proofroll_pybullet.world import World

_CAPABILITY = MechanismCapability
PROVIDES: frozenset[str] = frozenset(
    {
        _CAPABILITY.FIXED, _CAPABILITY.REVOLUTE, _CAPABILITY.PRISMATIC, _CAPABILITY.SPHERICAL,
        _CAPABILITY.REVOLUTE_LOOP, _CAPABILITY.SPHERICAL_LOOP, _CAPABILITY.REDUNDANT, _CAPABILITY.JOINT_SPRINGS,
        _CAPABILITY.ACTUATORS, _CAPABILITY.SATURATION, _CAPABILITY.SIGNALS, _CAPABILITY.JOINT_FRICTION,
    }
)  # fmt: skip
LACKING: Mapping[str, str] = {
    _CAPABILITY.SPRINGS: "PyBullet has no springs between points",
    _CAPABILITY.UNIVERSAL: "URDF has no such joint",
    _CAPABILITY.ARMATURE: "PyBullet's joints have no inertia of their own",
    _CAPABILITY.COUPLINGS: "PyBullet's gears have no offset, and this adapter builds none",
    _CAPABILITY.STOPS: "PyBullet's limits of joints throw back what a step has sunk in, by centimetres at 1 ms",
    _CAPABILITY.REBOUNDS: "PyBullet's limits of joints have no restitution",
}
_TYPES = {"fixed": "fixed", "revolute": "continuous", "prismatic": "prismatic", "spherical": "spherical"}
_ROWS = "a loop's rows are those of the step's start, and the first step does not yet know that they turn"
_LARGE = 1e9  # stands for no limit: of force [N], speed, travel [m]


class PybulletMechanism:
    """Run of a mechanism; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, mechanism: Mechanism, settings: PybulletSettings) -> None:
        for body in mechanism.bodies:
            if not body.mass:
                raise Refused(f"{body.name} has no mass; PyBullet would take it for a part of the world")
        self._mechanism, self._settings, self._steps = mechanism, settings, 0
        self._tree = Tree(mechanism)
        self._world = World(mechanism.gravity, settings)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "mechanism.urdf"
            file.write_text(urdf(mechanism), encoding="utf-8")
            flags = self._world.URDF_USE_INERTIA_FROM_FILE  # else it computes inertias from collision shapes
            self._robot = self._world.loadURDF(str(file), useFixedBase=True, flags=flags)
        count = self._world.getNumJoints(self._robot)
        told = [self._world.getJointInfo(self._robot, index) for index in range(count)]
        self._links = {info[12].decode(): index for index, info in enumerate(told)} | {WORLD: -1}
        self._joints = [self._links[joint.child] for joint in mechanism.joints]
        motors = {
            joint.name: [item for item in mechanism.actuators if item.joint == joint.name] for joint in mechanism.joints
        }
        self._forced = [
            (joint, motors[joint.name])
            for joint in mechanism.joints
            if joint.torque or joint.stiffness or joint.damping or motors[joint.name]
        ]
        for joint, index in zip(mechanism.joints, self._joints, strict=True):
            self._start(joint, index)
        for loop in mechanism.loops:
            for far in held_points(mechanism, loop):  # one point alone leaves a revolute loop in space free to turn
                on_a = self._from_com(loop.body_a, loop.position_a + far * loop.frame_a[:, 2])
                on_b = self._from_com(loop.body_b, loop.position_b + far * loop.frame_b[:, 2])
                held = self._world.createConstraint(
                    self._robot, self._links[loop.body_a], self._robot, self._links[loop.body_b],
                    self._world.JOINT_POINT2POINT, [0, 0, 1], on_a, on_b,
                )  # fmt: skip
                self._world.changeConstraint(held, maxForce=_LARGE)

    @classmethod
    def build(cls, scene: Scene, settings: PybulletSettings) -> PybulletMechanism:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(mechanism_of(scene), settings)

    def _start(self, joint: Joint, index: int) -> None:
        """Sets the initial state of a joint, and removes PyBullet's default motor that holds it."""
        robot = self._robot
        if self._settings.preset == "matched":
            self._world.changeDynamics(
                robot, index, linearDamping=0, angularDamping=0, jointDamping=0, maxJointVelocity=_LARGE,
            )  # fmt: skip
        if joint.nv == 1:
            self._world.resetJointState(robot, index, joint.q0[0], joint.v0[0])
            # a velocity motor with target 0 and bounded force is dry friction; PyBullet ignores that of a URDF
            self._world.setJointMotorControl2(robot, index, self._world.VELOCITY_CONTROL, force=joint.friction)
        elif joint.nv == 3:
            q = [*joint.q0[1:], joint.q0[0]]
            self._world.resetJointStateMultiDof(robot, index, q, list(joint.v0))
            self._world.setJointMotorControlMultiDof(
                robot, index, self._world.POSITION_CONTROL, targetPosition=[0, 0, 0, 1], positionGain=0, velocityGain=0,
                force=[0, 0, 0],
            )  # fmt: skip

    def _from_com(self, body: str, position: Any) -> list[float]:
        """Position of a point relative to the body's centre of mass [m], as PyBullet needs pivots."""
        if body == WORLD:
            return list(position)
        return list(np.array(position) - self._mechanism.bodies[self._mechanism.body_index[body]].com)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        dt = self._settings.dt
        for _ in range(whole_steps(self._steps * dt, t, dt)):
            now = self._steps * dt
            for joint, motors in self._forced:
                index = self._links[joint.child]
                q, v, *_ = self._world.getJointState(self._robot, index)
                force = float(value_at(joint.torque, now)) - joint.stiffness * (q - joint.rest) - joint.damping * v
                force += sum(item.effort(now, q, v) for item in motors)
                self._world.setJointMotorControl2(self._robot, index, self._world.TORQUE_CONTROL, force=force)
            self._world.stepSimulation()
            self._steps += 1
        if not all(map(math.isfinite, self._state()[1])):
            raise Diverged(f"PyBullet's joint velocities are not finite at t = {t:g} s")

    def _state(self) -> tuple[Any, Any]:
        """Coordinates and velocities of the tree."""
        q: list[float] = []
        v: list[float] = []
        for joint, index in zip(self._mechanism.joints, self._joints, strict=True):
            if joint.nv == 1:
                place, rate, *_ = self._world.getJointState(self._robot, index)
                q, v = [*q, place], [*v, rate]
            elif joint.nv == 3:
                turned, rates, *_ = self._world.getJointStateMultiDof(self._robot, index)
                q, v = [*q, turned[3], *turned[:3]], [*v, *rates]
        return np.array(q), np.array(v)

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`; no reactions, for PyBullet's are wrong in chains of links."""
        motion = self._tree.at(*self._state())
        turned = np.array([to_quaternion(R) for R in motion.R_WB[:-1]])
        return MechanismSample(motion.p_WB[:-1], motion.v_WB[:-1], motion.w_WB[:-1], turned, effort=self._efforts())

    def _efforts(self) -> Any:
        """Efforts of the actuators in the present state, applied in the next step; None: there are no actuators."""
        (q, v), mechanism = self._state(), self._mechanism
        places = [(item, *mechanism.place_of(item.joint)) for item in mechanism.actuators]
        now = self._steps * self._settings.dt
        return (
            np.array([item.effort(now, float(q[at]), float(v[rate])) for item, at, rate in places]) if places else None
        )

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        mass, com, inertia = [], [], []
        for body in self._mechanism.bodies:
            told = self._world.getDynamicsInfo(self._robot, self._links[body.name])
            x, y, z, w = told[4]
            R = from_quaternion((w, x, y, z))
            mass.append(told[0])
            com.append(np.array(told[3]) + _joint_of(self._mechanism, body).child_position)
            inertia.append(R @ np.diag(told[2]) @ R.T)
        moves = bool(self._mechanism.loops) and bool(np.any(self._mechanism.start()[1]))
        soft = {name: Regularised(1.0, _ROWS) for name in ("acceleration", "angular_acceleration") if moves}
        return MechanismBuilt(
            np.array(mass), np.array(com), np.array(inertia), gravity=self._world.gravity(), regularised=soft
        )


def urdf(mechanism: Mechanism) -> str:
    """URDF of the bodies and joints; a link has its frame at its joint, with the body's axes."""
    base = {WORLD: np.zeros(3)} | {
        body.name: np.array(_joint_of(mechanism, body).child_position) for body in mechanism.bodies
    }
    parts = [f'<robot name="mechanism"><link name="{WORLD}"/>']
    for body in mechanism.bodies:
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia
        parts.append(
            f'<link name="{body.name}"><inertial><origin xyz="{_numbers(body.com - base[body.name])}"/>'
            f'<mass value="{body.mass!r}"/><inertia ixx="{xx!r}" ixy="{xy!r}" ixz="{xz!r}" iyy="{yy!r}" iyz="{yz!r}" '
            f'izz="{zz!r}"/></inertial></link>'
        )
    for joint in mechanism.joints:
        place = _numbers(joint.position - base[joint.parent])
        limit = f'<limit lower="{-_LARGE}" upper="{_LARGE}" effort="{_LARGE}" velocity="{_LARGE}"/>'
        parts.append(
            f'<joint name="{joint.name}" type="{_TYPES[joint.kind]}"><parent link="{joint.parent}"/>'
            f'<child link="{joint.child}"/><origin xyz="{place}" rpy="{_numbers(joint.orientation)}"/>'
            f'<axis xyz="{_numbers(joint.axis)}"/>{limit}</joint>'
        )
    return "\n".join([*parts, "</robot>"])


def _joint_of(mechanism: Mechanism, body: Body) -> Joint:
    return next(joint for joint in mechanism.joints if joint.child == body.name)


def _numbers(values: Any) -> str:
    return " ".join(repr(float(value)) for value in values)
