"""Loads of springs, bushings, applied forces and drives on the bodies of a mechanism, and targets, at one state."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from proofroll.core.arrays import cross
from proofroll.core.errors import Diverged
from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion
from proofroll.elements.mechanism.scene.bushing import LARGEST
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.kinks import Functions, Sides
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.parts import Force, Spring
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import FUNCTIONS, value_at


class PointLoad(NamedTuple):
    """Load on a body, in world axes.

    Attributes:
        body: index of the body; -1: the world.
        arm: from the origin of the body's frame to the place of the force [m].
        force: [N].
        moment: beside that of the force at its arm [N m].
    """

    body: int
    arm: Array
    force: Array
    moment: Array

    def along(self, motion: BodyMotion) -> Array:
        """The load along the velocities of the tree, (nv)."""
        return np.asarray(np.concatenate([self.force, self.moment + cross(self.arm, self.force)]) @ motion.J[self.body])


def point_loads(
    mechanism: Mechanism, motion: BodyMotion, time: float, functions: Functions = FUNCTIONS
) -> Iterator[PointLoad]:
    """Loads of springs, bushings and applied forces at a time [s], for the motion of bodies and world.

    ``functions``: of their formulas.

    Raises:
        Diverged: a bushing turns too far.
    """
    index = mechanism.body_index
    yield from spring_loads(mechanism, motion, lambda spring, *state: spring.pull(*state, functions))
    for bushing in mechanism.bushings:
        if bushing.turned(motion.R_WB[index[bushing.body_a]], motion.R_WB[index[bushing.body_b]]) > LARGEST:
            advice = "at half a turn its rotation vector is not unique; give a joint the spring"
            raise Diverged(f"the bushing {bushing.name} turns by more than {LARGEST:g} rad: {advice}")
    yield from bushing_loads(mechanism, motion)
    for applied in mechanism.forces:
        yield from applied_loads(mechanism, applied, motion, time, functions)


def spring_loads(
    mechanism: Mechanism, motion: BodyMotion, pull_of: Callable[[Spring, float, float], float]
) -> Iterator[PointLoad]:
    """Loads of springs, on both bodies of each; ``pull_of``: of a spring, its length [m] and its rate [m/s], N."""
    none, index = np.zeros(3), mechanism.body_index
    for spring in mechanism.springs:
        a, b = index[spring.body_a], index[spring.body_b]
        arm_a, arm_b = motion.R_WB[a] @ spring.position_a, motion.R_WB[b] @ spring.position_b
        d = motion.p_WB[b] + arm_b - motion.p_WB[a] - arm_a
        slide = motion.v_WB[b] + cross(motion.w_WB[b], arm_b) - motion.v_WB[a] - cross(motion.w_WB[a], arm_a)
        length = float(np.linalg.norm(d))
        direction = d / length
        pull = pull_of(spring, length, float(direction @ slide))
        yield PointLoad(a, arm_a, pull * direction, none)
        yield PointLoad(b, arm_b, -pull * direction, none)


def applied_loads(
    mechanism: Mechanism, applied: Force, motion: BodyMotion, time: float, functions: Functions = FUNCTIONS
) -> Iterator[PointLoad]:
    """Loads of an applied force or moment at a time [s], on its body and on that of its reaction."""
    none, index = np.zeros(3), mechanism.body_index
    acting, reacting = index[applied.body], index[applied.reaction]
    size = np.array(applied.at(time, functions), dtype=float)
    load = motion.R_WB[acting] @ size if applied.frame == "body" else size
    force, moment = (load, none) if applied.kind == "force" else (none, load)
    arm = motion.R_WB[acting] @ applied.position
    yield PointLoad(acting, arm, force, moment)
    yield PointLoad(reacting, motion.p_WB[acting] + arm - motion.p_WB[reacting], -force, -moment)


def loads_at(mechanism: Mechanism, t: float, p_WB: Array, R_WB: Array) -> tuple[Array, Array]:
    """Force [N] and moment about its origin [N m] of drives and applied forces on each body, world axes, (bodies, 3).

    Reactions on other bodies are among them. For adapters that set loads from outside.

    Args:
        mechanism: with the drives and forces.
        t: time [s].
        p_WB: origins of the bodies [m], (bodies, 3).
        R_WB: rotations of the bodies, (bodies, 3, 3).
    """
    p, R = np.vstack([p_WB, np.zeros(3)]), np.concatenate([R_WB, np.eye(3)[None]])
    other_arrays = dict.fromkeys(("v_WB", "w_WB", "J", "bias", "p_joint", "R_parent", "q"), np.zeros(0))
    motion = BodyMotion(p_WB=p, R_WB=R, **other_arrays)  # no load here depends on these
    force, moment = np.zeros((2, *p.shape))  # the last row: of the world
    for load in _outside_loads(mechanism, motion, t):
        force[load.body] += load.force
        moment[load.body] += load.moment + cross(load.arm, load.force)
    return force[:-1], moment[:-1]


def _outside_loads(mechanism: Mechanism, motion: BodyMotion, t: float) -> Iterator[PointLoad]:
    for applied in mechanism.forces:
        yield from applied_loads(mechanism, applied, motion, t)
    p, R, none = motion.p_WB, motion.R_WB, np.zeros(3)
    for joint in mechanism.joints:
        parent, child = mechanism.body_index[joint.parent], mechanism.body_index[joint.child]
        effort = value_at(joint.torque, t) * R[child] @ joint.child_frame[:, 2]
        force, moment = (effort, none) if joint.kind == JointKind.PRISMATIC else (none, effort)
        arm = R[child] @ joint.child_position
        yield PointLoad(child, arm, force, moment)
        yield PointLoad(parent, p[child] + arm - p[parent], -force, -moment)


def targets_at(mechanism: Mechanism, t: float) -> Array:
    """Targets of all actuators at a time [s], in the scene's order, (actuators,); in the unit of each."""
    return np.array([float(value_at(item.target, t)) for item in mechanism.actuators])


def kink_arguments(mechanism: Mechanism, motion: BodyMotion, time: float) -> Array:
    """Arguments of the kinks of all laws at a time [s], in the order of the mechanism's kinks; zero at a kink."""
    sides = Sides(mechanism.kinks)
    functions = sides.functions(FUNCTIONS)
    for _ in point_loads(mechanism, motion, time, functions):
        pass
    for signal in mechanism.signals:
        value_at(signal, time, functions)
    return np.array(sides.arguments, dtype=float)


def bushing_loads(mechanism: Mechanism, motion: BodyMotion) -> Iterator[PointLoad]:
    """Loads of bushings alone, however far they turn."""
    index = mechanism.body_index
    for bushing in mechanism.bushings:
        a, b = index[bushing.body_a], index[bushing.body_b]
        arm_a, arm_b = motion.R_WB[a] @ bushing.position_a, motion.R_WB[b] @ bushing.position_b
        apart = motion.p_WB[b] + arm_b - motion.p_WB[a] - arm_a
        w_a, w_b = motion.w_WB[a], motion.w_WB[b]
        slide = motion.v_WB[b] + cross(w_b, arm_b) - motion.v_WB[a] - cross(w_a, arm_a)
        force, moment = bushing.load(motion.R_WB[a], motion.R_WB[b], apart, slide, w_a, w_b)
        yield PointLoad(b, arm_b, force, moment)
        yield PointLoad(a, arm_a + apart, -force, -moment)
