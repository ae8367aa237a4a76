"""PyBullet's own importer of URDF, with the multibody read back."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.robots.model import Array, RobotBody, composed
from proofroll.robots.protocol import AtState, Reading, Request, evaluate

# Step [s] from which accelerations are read: semi-implicit Euler gives that at its start exactly, for any step.
_STEP = 1e-2


class PybulletRobots:
    """Robot files as ``loadURDF`` reads them."""

    kinds: ClassVar[tuple[str, ...]] = ("urdf",)
    options: ClassVar[Mapping[str, str]] = {
        "inertia_from_file": "take inertias from the file, not from collision shapes (default here: true)",
        "merge_fixed": "merge links at fixed joints into their parents",
    }
    # PyBullet returns poses of links and of fixed joints in single precision, diagonalises inertias by a method that
    # stops at 1e-10, and accelerations are differences over one step.
    tolerances: ClassVar[Mapping[str, float]] = {
        "kinematics": 5e-6,
        "bodies": 1e-6,
        "mass matrix": 1e-9,
        "gravity": 1e-9,
        "bias": 1e-9,
        "inverse dynamics": 1e-9,
        "forward dynamics": 1e-9,
    }
    says: ClassVar[str] = ""

    def version(self) -> str:
        """Version of the package."""
        return importlib.metadata.version("pybullet")

    def read(self, request: Request) -> Reading:
        """See :class:`proofroll.robots.protocol.RobotReader`.

        With a free base, PyBullet's inverse dynamics corrupts memory, so all terms come from single steps.
        """
        robot = _Loaded(request)
        frames: dict[str, list[tuple[Array, Array]]] = {name: [] for name in robot.link}
        arrays = evaluate(request, robot.joints, robot.dofs, lambda k: robot.at(k, frames))
        groups = robot.groups()
        return Reading(
            robot.joints, robot.dofs,
            {name: body.mass for name, body in groups.items()},
            {name: body.com for name, body in groups.items()},
            {name: body.inertia for name, body in groups.items()},
            {name: np.array([p for p, _ in found]) for name, found in frames.items()},
            {name: np.array([R for _, R in found]) for name, found in frames.items()},
            remarks=(f"flags {robot.flags}", "velocity motors off, damping of the air off"),
            **arrays,
        )  # fmt: skip


def _matrix(quaternion: Any) -> Array:
    return np.asarray(Rotation.from_quat(quaternion).as_matrix())


class _Loaded:
    """A multibody in a world of its own."""

    def __init__(self, request: Request) -> None:
        import pybullet

        self.p, self.request = pybullet, request
        pybullet.connect(pybullet.DIRECT)
        pybullet.setPhysicsEngineParameter(enableFileCaching=0)
        pybullet.setGravity(*request.gravity)
        pybullet.setTimeStep(_STEP)
        flags = {
            "URDF_USE_INERTIA_FROM_FILE": request.options.get("inertia_from_file", True),
            "URDF_MERGE_FIXED_LINKS": request.options.get("merge_fixed", False),
        }
        value = sum(getattr(pybullet, name) for name, on in flags.items() if on)
        self.flags = "|".join(name for name, on in flags.items() if on) or "none"
        self.body = pybullet.loadURDF(str(request.path), useFixedBase=request.base == "fixed", flags=value)
        infos = [pybullet.getJointInfo(self.body, index) for index in range(pybullet.getNumJoints(self.body))]
        self.parents = [(info[16], np.array(info[14]), _matrix(info[15])) for info in infos]
        moving = [info for info in infos if info[2] != pybullet.JOINT_FIXED]
        if any(info[2] not in {pybullet.JOINT_REVOLUTE, pybullet.JOINT_PRISMATIC} for info in moving):
            raise RuntimeError("it made a joint that is neither revolute nor prismatic")
        self.indices = [int(info[0]) for info in moving]
        names = tuple(info[1].decode() for info in moving)
        for index in range(-1, len(infos)):
            pybullet.changeDynamics(self.body, index, linearDamping=0, angularDamping=0, maxJointVelocity=1e9)
        self.damping = {int(info[0]): float(info[6]) for info in moving}
        for index in self.indices:  # a step must not meet a limit either
            pybullet.changeDynamics(self.body, index, jointLowerLimit=-1e9, jointUpperLimit=1e9)
            pybullet.setJointMotorControl2(self.body, index, pybullet.VELOCITY_CONTROL, force=0)
        self.free = len(self.mass_matrix(np.zeros(len(names)))) == len(names) + 6
        self.joints = ((request.base_joint, *names)) if self.free else names
        self.dofs = (6, *(1,) * len(names)) if self.free else (1,) * len(names)
        self.link = dict(zip(names, self.indices, strict=True)) | ({request.base_joint: -1} if self.free else {})
        self.names = names

    def mass_matrix(self, q: Array) -> Array:
        """Mass matrix; velocities of a free base are at its centre of mass in principal axes, rotation first."""
        return np.array(self.p.calculateMassMatrix(self.body, list(q)))

    def inertial(self, index: int) -> tuple[float, Array, Array, Array]:
        """Mass [kg], principal moments [kg m²], position [m] and rotation of a link's principal frame in its own."""
        info = self.p.getDynamicsInfo(self.body, index)
        return float(info[0]), np.array(info[2]), np.array(info[3]), _matrix(info[4])

    def at(self, k: int, frames: dict[str, list[tuple[Array, Array]]]) -> AtState:
        """Terms of the multibody in state ``k``; adds the poses of links to ``frames``."""
        states = self.request.states
        q = np.array([states.angle[name][k] if name in states.angle else 0.0 for name in self.names])
        v = np.array([states.velocity[name][k][0] if name in states.velocity else 0.0 for name in self.names])
        n = len(q) + 6 * self.free
        T, drift = np.eye(n), np.zeros(n)
        pose = rate = None
        if self.free:
            name = self.request.base_joint
            _, _, c, A = self.inertial(-1)
            R, rate = states.rotation[name][k], states.velocity[name][k]
            r, E = R @ c, (R @ A).T
            pose = (states.position[name][k] + r, R @ A, r)
            T[:6, :6] = np.block([[np.zeros((3, 3)), E], [E, -E @ np.cross(np.eye(3), r)]])
            T[3:6, 3:6] = E @ np.array([np.cross(axis, r) for axis in np.eye(3)]).T
            drift[3:6] = -E @ np.cross(rate[3:], rate[:3])
        self.put(q, v, pose, rate)
        for name, index in self.link.items():
            frames[name].append(self.frame(index))
        M = self.mass_matrix(q)
        none = np.zeros(len(q))
        if not self.free:
            lists = [list(q), list(v), list(none)]
            g = np.array(self.p.calculateInverseDynamics(self.body, lists[0], lists[2], lists[2]))
            h = np.array(self.p.calculateInverseDynamics(self.body, *lists))
            own = list(q), list(v)
            return AtState(
                T, drift, M, g, h,
                lambda a: np.array(self.p.calculateInverseDynamics(self.body, *own, list(a))),
                lambda torque: self.stepped(q, v, pose, rate, torque, T, drift, damped=True),
            )  # fmt: skip
        still = np.zeros(6)
        g = -M @ self.stepped(q, none, pose, still, np.zeros(n), T, 0 * drift, damped=False)
        h = -M @ self.stepped(q, v, pose, rate, np.zeros(n), T, drift, damped=False)
        return AtState(
            T, drift, M, g, h, None, lambda torque: self.stepped(q, v, pose, rate, torque, T, drift, damped=True)
        )

    def put(self, q: Array, v: Array, pose: Any, rate: Array | None) -> None:
        """Sets the state: joint coordinates ``q`` and rates ``v``, and for a free base its pose and velocity.

        ``pose`` of the base: position and rotation of its principal frame, and vector from the link's origin there [m].
        """
        if pose is not None and rate is not None:
            place, turned, r = pose
            quaternion = Rotation.from_matrix(turned).as_quat()
            self.p.resetBasePositionAndOrientation(self.body, list(place), list(quaternion))
            self.p.resetBaseVelocity(self.body, list(rate[:3] + np.cross(rate[3:], r)), list(rate[3:]))
        for index, angle, speed in zip(self.indices, q, v, strict=True):
            self.p.resetJointState(self.body, index, angle, speed)

    def stepped(
        self, q: Array, v: Array, pose: Any, rate: Array | None, torque: Array, T: Array, drift: Array, *, damped: bool
    ) -> Array:
        """Accelerations in the engine's velocities, from the change of velocities over one step."""
        self.put(q, v, pose, rate)
        for index, damping in self.damping.items():
            self.p.changeDynamics(self.body, index, jointDamping=damping if damped else 0.0)
        for index, value in zip(self.indices, torque[6 * self.free :], strict=True):
            self.p.setJointMotorControl2(self.body, index, self.p.TORQUE_CONTROL, force=float(value))
        if pose is not None:
            place, turned, _ = pose
            self.p.applyExternalForce(self.body, -1, list(turned @ torque[3:6]), list(place), self.p.WORLD_FRAME)
            self.p.applyExternalTorque(self.body, -1, list(turned @ torque[:3]), self.p.WORLD_FRAME)
        self.p.stepSimulation()
        after = np.array([self.p.getJointState(self.body, index)[1] for index in self.indices])
        found = (after - v) / _STEP
        if pose is None or rate is None:
            return np.asarray(found)
        r = pose[2]
        linear, angular = (np.array(part) for part in self.p.getBaseVelocity(self.body))
        spin = (angular - rate[3:]) / _STEP
        pull = (linear - rate[:3] - np.cross(rate[3:], r)) / _STEP
        origin = pull - np.cross(spin, r) - np.cross(rate[3:], np.cross(rate[3:], r))
        return np.asarray(T @ np.concatenate([origin, spin, found]) + drift)

    def frame(self, index: int) -> tuple[Array, Array]:
        """Position and rotation of a link's frame in the world."""
        if index >= 0:
            state = self.p.getLinkState(self.body, index, computeForwardKinematics=1)
            return np.array(state[4]), _matrix(state[5])
        place, turned = self.p.getBasePositionAndOrientation(self.body)
        _, _, c, A = self.inertial(-1)
        R = _matrix(turned) @ A.T
        return np.array(place) - R @ c, R

    def groups(self) -> dict[str, RobotBody]:
        """Moving joint -> composite of the bodies that it carries rigidly."""
        homes = {index: (index, np.zeros(3), np.eye(3)) for index in (-1, *self.indices)}
        parts: dict[int, list[tuple[RobotBody, Array, Array]]] = {index: [] for index in homes}
        for index in range(-1, len(self.parents)):
            if index not in homes:
                parent, position, rotation = self.parents[index]
                home, p, R = homes[parent]
                _, _, c, A = self.inertial(parent)  # the joint is placed between the principal frames of both links
                homes[index] = (home, p + R @ (c + A @ position), R @ A @ rotation.T @ self.inertial(index)[3].T)
            home, p, R = homes[index]
            mass, moments, c, A = self.inertial(index)
            parts[home].append((RobotBody("", mass, c, A @ np.diag(moments) @ A.T), p, R))
        return {name: composed(name, parts[index]) for name, index in self.link.items()}
