"""Writes the records in this folder with PyBullet 3.2.7: ``pip install pybullet numpy; python record_all.py``."""

from __future__ import annotations

from pathlib import Path

import pybullet as bullet

HERE = Path(__file__).parent
ROWS, STEP = 16, 1 / 240
RECORDS = {  # what a user left as it is, or did
    "honest": {},
    "air": {"air": True},
    "defaults": {"air": True, "inertia_from_file": False},
    "motors": {"motors": True},
    "stop": {"start": 1.97},
    "servos": {"servos": True},
}


def record(
    name: str,
    *,
    air: bool = False,
    inertia_from_file: bool = True,
    motors: bool = False,
    servos: bool = False,
    start: float = -0.3,
) -> None:
    """Writes a record.

    Args:
        name: of its file.
        air: True if linear and angular damping of the links stay at 0.04.
        inertia_from_file: True if the flag says so.
        motors: True if the velocity motors stay on.
        servos: True if position control moves the joints; torques are then what getJointState returns.
        start: coordinate of the second joint [rad].
    """
    bullet.resetSimulation()
    bullet.setPhysicsEngineParameter(enableFileCaching=0)
    bullet.setGravity(0, 0, -9.81)
    bullet.setTimeStep(STEP)
    flags = bullet.URDF_USE_INERTIA_FROM_FILE if inertia_from_file else 0
    robot = bullet.loadURDF(str(HERE / "floater.urdf"), flags=flags)
    joints = range(bullet.getNumJoints(robot))
    if not motors:
        bullet.setJointMotorControlArray(robot, joints, bullet.VELOCITY_CONTROL, forces=[0, 0])
    for link in () if air else (-1, *joints):
        bullet.changeDynamics(robot, link, linearDamping=0, angularDamping=0)
    for joint, place, rate in zip(joints, (0.1, start), (0.4, 0.8), strict=True):
        bullet.resetJointState(robot, joint, place, rate)
    bullet.resetBasePositionAndOrientation(robot, [0.1, 0.2, 3.0], [0.6, 0.2, -0.4, 0.66332495807108])
    bullet.resetBaseVelocity(robot, [0.2, -0.3, 0.1], [0.5, -0.7, -0.2])
    names = [bullet.getJointInfo(robot, joint)[1].decode() for joint in joints]
    header = [f"{kind}.{joint}" for kind in ("q", "v", "effort") for joint in names]
    header += [f"{kind}.{axis}" for kind in ("p_WB", "v_WB", "w_WB") for axis in "xyz"]
    header += [f"q_WB.{axis}" for axis in "xyzw"]
    lines = [",".join(["time", *header])]
    for row in range(ROWS):
        time = row * STEP
        torques = [0.05 + 2 * time, 0.1 - 6 * time]
        states = bullet.getJointStates(robot, joints)
        place, attitude = bullet.getBasePositionAndOrientation(robot)
        velocity, spin = bullet.getBaseVelocity(robot)
        if servos:
            bullet.setJointMotorControlArray(
                robot, joints, bullet.POSITION_CONTROL, [0.5, 0.2], positionGains=[0.02, 0.02], velocityGains=[0.1, 0.1]
            )
            torques = [state[3] for state in states]
        else:
            bullet.setJointMotorControlArray(robot, joints, bullet.TORQUE_CONTROL, forces=torques)
        q, v, *_ = zip(*states, strict=True)
        numbers = [time, *q, *v, *torques, *place, *velocity, *spin, *attitude]
        lines.append(",".join(map(repr, numbers)))
        bullet.stepSimulation()
    (HERE / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    bullet.connect(bullet.DIRECT)
    for name, settings in RECORDS.items():
        record(name, **settings)
