"""Random states of a robot, and the convention of coordinates and velocities for all results.

Velocities are ordered as the moving joints of the tree. A revolute or prismatic joint has the rate of its coordinate; a
spherical joint the angular velocity in the child's axes; a free joint the velocity of the child's origin and then its
angular velocity, both in world axes.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import ONE_COORDINATE, JointKind
from proofroll.elements.mechanism.scene.rotations import from_quaternion
from proofroll.robots.model import Array, Robot

# Least speed of a joint: slower ones might stick where an engine smooths Coulomb friction [rad/s or m/s].
_SLOWEST = 0.2


@dataclasses.dataclass(frozen=True)
class RobotStates:
    """States by joint; the first axis counts states.

    Attributes:
        angle: coordinate of each revolute or prismatic joint [rad or m], shape (states,).
        rotation: of the child against the parent for each spherical joint, against the world for each free joint,
            shape (states, 3, 3).
        position: of the child's origin in the world for each free joint [m], shape (states, 3).
        velocity, acceleration: of each moving joint, shape (states, velocities of the joint).
    """

    angle: dict[str, Array]
    rotation: dict[str, Array]
    position: dict[str, Array]
    velocity: dict[str, Array]
    acceleration: dict[str, Array]

    @property
    def count(self) -> int:
        """Number of states."""
        return len(next(iter(self.velocity.values()), ()))

    def first(self, count: int) -> RobotStates:
        """States restricted to the first ``count``."""
        parts = {
            name: {joint: rows[:count] for joint, rows in by_joint.items()} for name, by_joint in vars(self).items()
        }
        return RobotStates(**parts)

    def stacked(self, rates: dict[str, Array], robot: Robot) -> Array:
        """Velocities or accelerations in the order of a robot's joints, shape (states, velocities)."""
        return np.concatenate([np.zeros((self.count, 0)), *(rates[joint.name] for joint in robot.moving)], axis=1)

    def completed(self, robot: Robot) -> RobotStates:
        """States of all joints of a robot; joints that are absent here are at rest at coordinate 0."""
        added = [joint for joint in robot.moving if joint.name not in self.velocity]
        if not added:
            return self
        count = self.count
        turning = [joint for joint in added if joint.dofs > 1]
        rest = {joint.name: np.zeros((count, joint.dofs)) for joint in added}
        return RobotStates(
            angle=self.angle | {joint.name: np.zeros(count) for joint in added if joint.dofs == 1},
            rotation=self.rotation | {joint.name: np.tile(np.eye(3), (count, 1, 1)) for joint in turning},
            position=self.position
            | {joint.name: np.zeros((count, 3)) for joint in turning if joint.kind == JointKind.FREE},
            velocity=self.velocity | rest,
            acceleration=self.acceleration | rest,
        )


def random_states(robot: Robot, count: int, seed: int) -> RobotStates:
    """Random states within the limits of the joints (or ±π, ±1 m), with moderate velocities, consistent with mimics."""
    random = np.random.default_rng(seed)
    angle, rotation, position = {}, {}, {}
    for joint in robot.moving:
        if joint.kind in ONE_COORDINATE:
            reach = np.pi if joint.kind == JointKind.REVOLUTE else 1.0
            limits = (-reach if joint.lower is None else joint.lower, reach if joint.upper is None else joint.upper)
            near = (max(limits[0], -reach), min(limits[1], reach))
            usable = (ends for ends in (near, limits) if ends[0] < ends[1])
            angle[joint.name] = random.uniform(*next(usable, (-reach, reach)), count)
        else:
            vector_first = random.normal(size=(count, 4))  # scaled to unit length, uniform over all rotations
            rotation[joint.name] = np.array([from_quaternion(q) for q in np.roll(vector_first, 1, axis=1)])
            if joint.kind == JointKind.FREE:
                position[joint.name] = random.uniform(-1, 1, (count, 3))
    velocity = {
        joint.name: random.uniform(_SLOWEST, 1, (count, joint.dofs)) * random.choice([-1.0, 1.0], (count, joint.dofs))
        for joint in robot.moving
    }
    acceleration = {joint.name: random.uniform(-1, 1, (count, joint.dofs)) for joint in robot.moving}
    for mimic in robot.mimics:
        angle[mimic.joint] = mimic.multiplier * angle[mimic.other] + mimic.offset
        for rates in (velocity, acceleration):
            rates[mimic.joint] = mimic.multiplier * rates[mimic.other]
    return RobotStates(angle=angle, rotation=rotation, position=position, velocity=velocity, acceleration=acceleration)
