"""Start and efforts of a robot in the air whose record shows what a simulator holds of it."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.errors import InputError, choices
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.files.scene_sources import ProbeStart
from proofroll.robots.control.bookkeeping.air import AirRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.controlled import ControlledScenes
from proofroll.robots.files.scene_tables import read_robot
from proofroll.robots.model import RobotJoint
from proofroll.robots.states import random_states

_SEED = 1
# Part of the range of a joint about its middle in which it starts; acceleration at the start [rad/s² or m/s²], less
# where its range or its largest speed is small; part of its largest effort that is used.
_INNER, _ACCELERATION, _EFFORT = 0.5, 20.0, 0.5


def probe_start(path: Path, *, free: bool) -> ProbeStart:
    """Start inside the limits of the joints, with efforts that keep them there for a tenth of a second.

    Args:
        path: of the robot file.
        free: True if nothing holds the root of a URDF.

    Raises:
        InputError: the robot is no tree of revolute and prismatic joints, or it cannot be moved.
    """
    file, robot = read_robot(path, "free" if free else "fixed")
    floats = bool(robot.moving) and robot.moving[0].kind == JointKind.FREE
    constrained = [item.joint for item in robot.mimics]
    constrained += [*(item.name for item in robot.loops), *(item.name for item in robot.ties)]
    constrained += [joint.name for joint in robot.moving[floats:] if joint.dofs > 1]
    if constrained:
        advice = f"a probe moves a tree of revolute and prismatic joints, and this robot has {choices(constrained)}"
        raise InputError("robot", path, advice)
    mechanism = ControlledScenes(None).of_record(path, free=free).mechanism
    law = ControlLaw.of_efforts(mechanism)
    air, states = AirRobot(mechanism, law), random_states(robot, 1, _SEED)
    base = None
    if floats:
        name = robot.moving[0].name
        attitude = Rotation.from_matrix(states.rotation[name][0]).as_quat(scalar_first=True)
        base = np.concatenate([states.position[name][0], attitude, states.velocity[name][0]])
    joints = {joint.name: joint for joint in robot.moving}
    starts = [_inside(joints[name], states.angle[name][0], states.velocity[name][0, 0]) for name in air.joints]
    q, v, accelerations = np.reshape(starts, (-1, 3)).T
    M, inner, weight, *_ = air.forces(*air.coordinates(q, v, base))
    moved = air.places[:, 1]
    efforts = []
    for part in (0.0, 1.0):
        rate = np.zeros(len(M))
        rate[moved] = part * accelerations
        if air.base is not None:
            places = air.base[1]
            rate[places] = np.linalg.solve(M[places, places], (inner + weight - M @ rate)[places])
        efforts.append((M @ rate - inner - weight)[moved])
    constant, swing = efforts[0], efforts[1] - efforts[0]
    limits = [np.inf if joints[name].effort is None else joints[name].effort for name in air.joints]
    usable = _EFFORT * np.array(limits)
    constant = np.clip(constant, -usable, usable)
    swing = np.clip(swing, np.abs(constant) - usable, usable - np.abs(constant))
    columns = np.stack([q, v, constant, swing, law.kd], axis=1)
    return ProbeStart(
        kind=file.kind,
        base=None if base is None else tuple(base.tolist()),
        joints={name: tuple(row) for name, row in zip(air.joints, columns.tolist(), strict=True)},
    )


def _inside(joint: RobotJoint, coordinate: float, rate: float) -> tuple[float, float, float]:
    """Coordinate in the inner part of a joint's range, rate, and an acceleration along it, so that nothing sticks."""
    width, middle = np.inf, coordinate
    if joint.lower is not None and joint.upper is not None and joint.lower < joint.upper:
        width, middle = joint.upper - joint.lower, (joint.lower + joint.upper) / 2
    share = min(1.0, width, joint.speed / 2 if joint.speed else 1.0)
    return middle + _INNER * (coordinate - middle), share * rate, share * float(np.sign(rate)) * _ACCELERATION
