"""Loads on bodies that MuJoCo's model has none for: springs with a formula, bushings, applied forces."""

import itertools
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import cross
from proofroll.elements.mechanism import WORLD, Mechanism
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.rotations import Array


def springs_of_balls(mechanism: Mechanism) -> dict[str, Bushing]:
    """Joint -> spring that MuJoCo's ball joint has itself: the first bushing there that is alike in all directions."""
    pairs = itertools.product(mechanism.joints, reversed(mechanism.bushings))
    return {joint.name: bushing for joint, bushing in pairs if bushing.is_spring_of(joint)}


class AppliedLoads:
    """Sets ``xfrc_applied`` from the poses and velocities of bodies.

    Args:
        model: MuJoCo's model.
        mechanism: with the loads.
        index: body name, or ``world`` -> MuJoCo's number.

    Attributes:
        any: True if there are such loads.
    """

    def __init__(self, model: Any, mechanism: Mechanism, index: Mapping[str, int]) -> None:
        self._model = model
        self._springs = [
            (s, s.force, index[s.body_a], index[s.body_b]) for s in mechanism.springs if s.force is not None
        ]
        balls = springs_of_balls(mechanism)
        self._balls = [
            (mechanism.joint_index[joint], b, index[b.body_a], index[b.body_b]) for joint, b in balls.items()
        ]
        native = {bushing.name for bushing in balls.values()}
        self._bushings = [(b, index[b.body_a], index[b.body_b]) for b in mechanism.bushings if b.name not in native]
        coms, self._still, self._forces = (
            {body.name: body.com for body in mechanism.bodies},
            np.zeros((model.nbody, 6)),
            [],
        )
        for force in mechanism.forces:  # those that no pose and no time changes are added up once
            central = force.kind == "force" and force.reaction == WORLD and force.position == coms[force.body]
            if central and force.frame == "world" and all(isinstance(part, float) for part in force.value):
                self._still[index[force.body], :3] += force.value
            else:
                self._forces.append((force, index[force.body], index[force.reaction]))
        self.any = bool(self._springs or self._bushings or mechanism.forces)

    def apply(self, data: Any) -> None:
        """Sets the loads for the time, poses and velocities of ``data``."""
        data.xfrc_applied[:] = self._still
        for spring, law, a, b in self._springs:
            (place_a, velocity_a, _), (place_b, velocity_b, _) = (
                self._point(data, *end) for end in ((a, spring.position_a), (b, spring.position_b))
            )
            length = float(np.linalg.norm(place_b - place_a))
            direction = (place_b - place_a) / length
            pull = law.pull(length, float(direction @ (velocity_b - velocity_a))) * direction
            _add(data, a, place_a, pull)
            _add(data, b, place_b, -pull)
        for bushing, a, b in self._bushings:
            (place_a, velocity_a, w_a), (place_b, velocity_b, w_b) = (
                self._point(data, *end) for end in ((a, bushing.position_a), (b, bushing.position_b))
            )
            R_a, R_b = (data.xmat[body].reshape(3, 3) for body in (a, b))
            force, moment = bushing.load(R_a, R_b, place_b - place_a, velocity_b - velocity_a, w_a, w_b)
            _add(data, b, place_b, force, moment)
            _add(data, a, place_b, -force, -moment)
        for applied, body, reaction in self._forces:
            R, load = data.xmat[body].reshape(3, 3), np.array(applied.at(float(data.time)), dtype=float)
            load = R @ load if applied.frame == "body" else load
            place = data.xpos[body] + R @ applied.position
            none = np.zeros(3)
            force, moment = (load, none) if applied.kind == "force" else (none, load)
            _add(data, body, place, force, moment)
            _add(data, reaction, place, -force, -moment)

    def take_springs(self, data: Any, torque: Array) -> None:
        """Subtracts the moments of springs that ball joints have themselves from those of joints, (joints, 3) [N m]."""
        none = np.zeros(3)
        for number, bushing, a, b in self._balls:
            R_a, R_b = (data.xmat[body].reshape(3, 3) for body in (a, b))
            torque[number] -= bushing.load(R_a, R_b, none, none, none, none)[1]

    def _point(self, data: Any, body: int, position: Any) -> tuple[Array, Array, Array]:
        """Place [m] and velocity [m/s] of a point of a body in the world, and the body's angular velocity [rad/s]."""
        arm, twist = data.xmat[body].reshape(3, 3) @ position, np.zeros(6)
        mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_XBODY, body, twist, 0)
        return data.xpos[body] + arm, twist[3:] + cross(twist[:3], arm), twist[:3]


def _add(data: Any, body: int, place: Array, force: Array, moment: Array | None = None) -> None:
    """Adds a force [N] at a place [m], and a moment [N m], to the load on a body, at its centre of mass."""
    data.xfrc_applied[body, :3] += force
    data.xfrc_applied[body, 3:] += cross(place - data.xipos[body], force)
    if moment is not None:
        data.xfrc_applied[body, 3:] += moment
