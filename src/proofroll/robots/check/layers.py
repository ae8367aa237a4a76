"""Layers of a comparison, ordered so that an error in one spoils the next, and an engine's difference at each."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np

from proofroll.core.arrays import slices
from proofroll.robots.check.two_formulations import Dynamics, Frames, TreeMotion, passive, world_jacobians
from proofroll.robots.model import Array, Robot, RobotBody, RobotJoint
from proofroll.robots.protocol import Reading
from proofroll.robots.states import RobotStates

# Layer: its name in few characters, and what is compared.
_LAYERS = {
    "joints": ("joints", "joints that are absent, added, or follow no other although the file says so"),
    "mass": ("mass", "mass carried by all moving joints [relative]"),
    "kinematics": ("poses", "position and rotation of each body [m, 1]"),
    "bodies": ("bodies", "mass, first moment and inertia of the bodies that each joint carries [relative, m]"),
    "mass matrix": ("M", "M [relative]"),
    "gravity": ("g", "torque of gravity [relative]"),
    "bias": ("h", "torque of gravity and velocities [relative]"),
    "inverse dynamics": ("inv", "torque for given accelerations, without damping, friction and springs [relative]"),
    "forward dynamics": (
        "fwd",
        "what is left of the equation of motion, damping, friction and springs included [relative]",
    ),
}
SHORT = {layer: short for layer, (short, _) in _LAYERS.items()}
LAYERS = {layer: compared for layer, (_, compared) in _LAYERS.items()}
# Round-off of two formulations is 1e-15 to 3e-14 on robots with up to 67 velocities; the smallest known defect of an
# importer is 1e-7.
TOLERANCE = 1e-10
# Least scale of torques, as a part of weight times one metre: smaller torques of gravity are round-off.
_FLOOR = 1e-3


@dataclasses.dataclass(frozen=True)
class RobotTruth:
    """A robot with its dynamics at some states, evaluated on first use.

    Attributes:
        robot, states: the robot and the states.
        like: truth of the unchanged robot, with its scales, torques and unchanged values; None: this one is unchanged.
    """

    robot: Robot
    states: RobotStates
    like: RobotTruth | None = None

    @classmethod
    def of(cls, robot: Robot, states: RobotStates, like: RobotTruth | None = None) -> RobotTruth:
        """Truth of a robot; joints that the states lack are at rest."""
        return cls(robot, states.completed(robot), like)

    def first(self, count: int) -> RobotTruth:
        """Truth restricted to the first states."""
        return RobotTruth(self.robot, self.states.first(count))

    @cached_property
    def dynamics(self) -> Dynamics:
        """Terms of the equation of motion by the first formulation."""
        if self.like is not None and _moves_alike(self.robot, self.like.robot):
            return self.like.dynamics
        return world_jacobians(self.robot, self.states, self._motion)

    @cached_property
    def _motion(self) -> TreeMotion:
        if self.like is not None and _joints_alike(self.robot, self.like.robot, _PLACES):
            return self.like._motion
        return TreeMotion.of(self.robot, self.states)

    @property
    def frames(self) -> Frames:
        """Poses of all bodies."""
        return self._motion.frames

    @cached_property
    def passive(self) -> Array:
        """Damping, friction and springs, shape (states, n)."""
        return passive(self.robot, self.states)

    @cached_property
    def scales(self) -> dict[str, float]:
        """Scale of each layer's differences: the layer's largest value, or a floor against round-off."""
        if self.like is not None:
            return self.like.scales
        groups = self.robot.groups.values()
        mass = sum(group.mass for group in groups)
        floor = _FLOOR * mass * float(np.linalg.norm(self.robot.gravity) or 1.0)
        inertia = float(np.abs(self.dynamics.M).max())
        fastest = float(np.abs(self.states.stacked(self.states.velocity, self.robot)).max(initial=0.0))
        turning = _FLOOR * inertia * fastest**2  # moments of a body that turns, which cancel where it is round
        sizes = {
            "mass": mass,
            "bodies": max((float(np.abs(group.inertia).max()) for group in groups), default=0.0),
            "mass matrix": inertia,
            "gravity": max(float(np.abs(self.dynamics.g).max()), floor),
            "bias": max(float(np.abs(self.dynamics.h).max()), floor, turning),
            "inverse dynamics": max(float(np.abs(self.inverse).max()), floor),
            "forward dynamics": max(float(np.abs(self.inverse + self.passive).max()), floor),
        }
        return {layer: size or 1.0 for layer, size in sizes.items()}

    @cached_property
    def inverse(self) -> Array:
        """Torque for the accelerations of the states without passive forces, shape (states, n)."""
        return self._without_passive(self.states.stacked(self.states.acceleration, self.robot))

    def torque(self, acceleration: Array) -> Array:
        """Torque for these accelerations, shape (states, n)."""
        return self._without_passive(acceleration) + self.passive

    def _without_passive(self, acceleration: Array) -> Array:
        return np.asarray(np.einsum("sij,sj->si", self.dynamics.M, acceleration)) + self.dynamics.h

    @cached_property
    def torques(self) -> dict[str, Array]:
        """Torques for which engines compute the forward dynamics, by joint, shape (states, velocities of the joint).

        They give the accelerations of the states. A changed robot has the torques of ``like``, which the engine was
        given, and zero at joints that ``like`` lacks.
        """
        if self.like is not None:
            count = self.states.count
            return {
                joint.name: self.like.torques.get(joint.name, np.zeros((count, joint.dofs)))
                for joint in self.robot.moving
            }
        torques = self.inverse + self.passive
        return {name: torques[:, columns] for name, columns in self.robot.columns.items()}


# Attributes of joints that enter the passive forces only, not M, h or poses.
_PASSIVE = {"damping", "friction", "stiffness", "rest", "ref"}
_MOTION = [field.name for field in dataclasses.fields(RobotJoint) if field.name not in _PASSIVE]
# Attributes of joints on which poses and Jacobians depend.
_PLACES = ("name", "kind", "parent", "child", "position", "rotation", "axis", "child_position")


def _moves_alike(robot: Robot, rival: Robot) -> bool:
    """True if the robots differ only in passive forces and couplings."""
    return robot.bodies is rival.bodies and robot.gravity is rival.gravity and _joints_alike(robot, rival, _MOTION)


def _joints_alike(robot: Robot, rival: Robot, attributes: Sequence[str]) -> bool:
    """True if the joints of two robots have the same values of some attributes."""
    return len(robot.joints) == len(rival.joints) and all(
        getattr(joint, name) is getattr(partner, name)
        for joint, partner in zip(robot.joints, rival.joints, strict=True)
        for name in attributes
    )


def differences(truth: RobotTruth, reading: Reading, until: str = "") -> dict[str, float]:
    """Relative difference of an engine's reading from the truth, by layer; without layers that it does not offer.

    May stop after the layer ``until``, to save time in a search: most tried robots fail at an early layer.
    """
    robot = truth.robot
    dofs = dict(zip(reading.joints, reading.dofs, strict=True))
    followers = {mimic.joint for mimic in robot.mimics}
    expected = {joint.name: joint.dofs for joint in robot.moving}
    reduced = {name for name in followers if name not in dofs}
    unlike = {name for name in expected.keys() | dofs.keys() if expected.get(name) != dofs.get(name)} - reduced
    free = followers - reduced - set(reading.coupled)
    off = {"joints": float(len(unlike | free))}
    common = [name for name in reading.joints if expected.get(name) == dofs[name]]
    if not common or until == "joints":
        return off
    G, spans = _selection(robot, common, reduced), dict(zip(reading.joints, slices(reading.dofs), strict=True))
    theirs = [index for name in common for index in range(spans[name].start, spans[name].stop)]
    groups = robot.groups
    both = [name for name in common if name in reading.mass]
    scales = truth.scales
    masses = [reading.mass[name] - groups[name].mass for name in both]
    off["mass"] = abs(sum(masses)) / scales["mass"]
    off["kinematics"] = _kinematics(truth, reading, both)
    off["bodies"] = _largest(
        [abs(mass) / scales["mass"] for mass in masses]
        + [_apart(reading.com[name], reading.mass[name], groups[name], scales["mass"]) for name in both]
        + [np.abs(reading.inertia[name] - groups[name].inertia).max() / scales["bodies"] for name in both]
    )
    if until in {"mass", "kinematics", "bodies"}:
        return off
    d = truth.dynamics
    off["mass matrix"] = _off(reading.M[:, theirs][:, :, theirs], _between(G, d.M), scales["mass matrix"])
    for layer, torque, expected_torque in (("gravity", reading.g, d.g), ("bias", reading.h, d.h)):
        off[layer] = _off(torque[:, theirs], expected_torque @ G, scales[layer])
    if reading.inverse is not None:
        off["inverse dynamics"] = _off(reading.inverse[:, theirs], truth.inverse @ G, scales["inverse dynamics"])
    if reading.forward is not None and not d.singular:
        applied = np.concatenate([truth.torques[joint.name] for joint in robot.moving], axis=1)
        reached = reading.forward[:, theirs] @ G.T
        off["forward dynamics"] = _off(truth.torque(reached) @ G, applied @ G, scales["forward dynamics"])
    return off


def first_failing(differences: dict[str, float], tolerances: dict[str, float]) -> str | None:
    """First layer whose difference exceeds its tolerance or is NaN; None: all hold."""
    return next((layer for layer, value in differences.items() if not value <= tolerances[layer]), None)


def _between(G: Array, M: Array) -> Array:
    """Gᵀ M G for each state; by indexing if every column of G selects one velocity."""
    if np.count_nonzero(G) == G.shape[1] and np.all(G.sum(axis=0) == 1):
        rows = G.argmax(axis=0)
        return np.asarray(M[:, rows[:, None], rows])
    return np.asarray(G.T @ M @ G)


def _selection(robot: Robot, joints: Iterable[str], reduced: set[str]) -> Array:
    """Matrix from velocities of some joints to those of all, shape (n, some).

    Followers in ``reduced`` move with their joints; other joints are at rest.
    """
    columns, dofs = robot.columns, robot.dofs
    followers = {mimic.joint: mimic for mimic in robot.mimics}
    blocks = [np.zeros((dofs, 0))]
    for name in joints:
        block = np.zeros((dofs, columns[name].stop - columns[name].start))
        block[columns[name]] = np.eye(block.shape[1])
        for follower in reduced:
            if followers[follower].other == name:
                block[columns[follower]] = followers[follower].multiplier
        blocks.append(block)
    return np.concatenate(blocks, axis=1)


def _kinematics(truth: RobotTruth, reading: Reading, joints: list[str]) -> float:
    children = {joint.name: joint.child for joint in truth.robot.moving}
    true = truth.frames
    off = []
    for name in joints:
        if name in reading.position:
            p, R = true[children[name]]
            off += [np.abs(reading.position[name] - p).max(), np.abs(reading.rotation[name] - R).max()]
    return _largest(off)


def _apart(com: Array, mass: float, group: RobotBody, whole: float) -> float:
    """Difference of first moments of mass over the whole mass [m]; defined also for a body without mass."""
    return float(np.abs(mass * com - group.mass * group.com).max()) / whole


def _off(values: Array, true: Array, scale: float) -> float:
    return _largest([np.abs(values - true).max(initial=0.0) / scale])


def _largest(values: Iterable[float]) -> float:
    """The largest value; infinity if one is not finite."""
    values = [float(value) for value in values]
    return max(values, default=0.0) if np.all(np.isfinite(values)) else float("inf")


_TORQUES = ("gravity", "bias", "inverse dynamics")


def worst_place(truth: RobotTruth, reading: Reading, layer: str) -> str | None:
    """Clause with joint or body, state (counted from 0), the engine's and the true value; None: not for this layer."""
    groups = truth.robot.groups
    common = [name for name in reading.joints if name in groups]
    bodies = {joint.name: joint.child for joint in truth.robot.moving}
    carried = [name for name in common if name in reading.mass]
    if layer in {"mass", "bodies"} and carried:
        kinds: dict[str, tuple[dict[str, Array], dict[str, Array]]] = {
            "mass": ({n: np.array(reading.mass[n]) for n in carried}, {n: np.array(groups[n].mass) for n in carried}),
            "centre of mass": (reading.com, {n: groups[n].com for n in carried}),
            "inertia": (reading.inertia, {n: groups[n].inertia for n in carried}),
        }
        for what, (values, true) in kinds.items():
            worst = max(carried, key=lambda name: float(np.abs(values[name] - true[name]).max()))
            numbers, true_numbers = np.ravel(values[worst]), np.ravel(true[worst])
            index = int(np.argmax(np.abs(numbers - true_numbers)))
            if abs(numbers[index] - true_numbers[index]) > 1e-9 * max(abs(numbers[index]), abs(true_numbers[index])):
                return f"body {bodies[worst]}: {what} {numbers[index]:.6g}, true {true_numbers[index]:.6g}"
    if layer == "kinematics":
        true_poses = truth.frames
        differences = [
            (float(np.abs(values - true).max(axis=axes)[state]), name, what, state)
            for name in common
            if name in reading.position
            for what, values, true, axes in (
                ("position", reading.position[name], true_poses[bodies[name]][0], (1,)),
                ("rotation", reading.rotation[name], true_poses[bodies[name]][1], (1, 2)),
            )
            for state in [int(np.argmax(np.abs(values - true).max(axis=axes)))]
        ]
        off, name, what, state = max(differences, default=(0.0, "", "", 0))
        return f"body {bodies[name]}: {what} off by {off:.3g} at state {state}" if name else None
    if layer in _TORQUES:
        texts, expected = {
            "gravity": (reading.g, truth.dynamics.g),
            "bias": (reading.h, truth.dynamics.h),
            "inverse dynamics": (reading.inverse, truth.inverse),
        }[layer]
        return None if texts is None else _torque(truth, reading, texts, expected)
    return None


def _torque(truth: RobotTruth, reading: Reading, values: Array, true: Array) -> str | None:
    start, worst = 0, (0.0, "")
    for name, dofs in zip(reading.joints, reading.dofs, strict=True):
        columns = truth.robot.columns.get(name)
        if columns is not None and columns.stop - columns.start == dofs:
            torque, true_torque = values[:, start : start + dofs], true[:, columns]
            state, index = np.unravel_index(int(np.argmax(np.abs(torque - true_torque))), torque.shape)
            sentence = (
                f"joint {name}: {torque[state, index]:.6g} at state {state}, true {true_torque[state, index]:.6g}"
            )
            worst = max(worst, (float(np.abs(torque - true_torque).max()), sentence))
        start += dofs
    return worst[1] or None
