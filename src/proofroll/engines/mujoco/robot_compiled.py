"""MuJoCo's compiled model as plain data: what an MJCF means."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.errors import Refused
from proofroll.robots.model import WORLD, Array, Mimic, Robot, RobotBody, RobotJoint

_KINDS = {0: "free", 1: "spherical", 2: "prismatic", 3: "revolute"}


def robot_of(model: Any) -> Robot:
    """The robot; a body with several joints is carried by bodies without mass, one for each further joint.

    Coordinates count from ``qpos0``, the pose that the file describes.

    Raises:
        Refused: the model has what is not covered: armature of a tendon, springs or dampers that are not linear.
    """
    if np.any(getattr(model, "tendon_armature", np.zeros(0))):
        raise Refused("a tendon has armature, which the check does not cover")
    if any(np.any(getattr(model, f"{name}poly", 0)) for name in ("jnt_stiffness", "dof_damping")):
        raise Refused("a joint has a spring or damper that is not linear, which the check does not cover")
    names = [WORLD, *(model.body(index).name for index in range(1, model.nbody))]
    bodies: dict[str, RobotBody] = {}
    joints: list[RobotJoint] = []
    driven = {int(model.actuator_trnid[index, 0]) for index in range(model.nu) if model.actuator_trntype[index] == 0}
    for index in range(1, model.nbody):
        name, parent = names[index], names[int(model.body_parentid[index])]
        bodies[name] = body_of(model, index, name)
        position, rotation = np.array(model.body_pos[index]), matrix(model.body_quat[index])
        first, count = int(model.body_jntadr[index]), int(model.body_jntnum[index])
        if not count:
            joints.append(RobotJoint(f"({name})", "fixed", parent, name, position, rotation, np.array([0.0, 0.0, 1.0])))
        for joint in range(first, first + count):
            last = joint == first + count - 1
            child = name if last else f"{name}/{joint - first}"
            if not last:
                bodies[child] = RobotBody(child, 0.0, np.zeros(3), np.zeros((3, 3)))
            joints.append(_joint(model, joint, parent, child, position, rotation, joint in driven))
            parent, position, rotation = child, np.zeros(3), np.eye(3)
    gravity = np.zeros(3) if _off(model, "GRAVITY") else np.array(model.opt.gravity)
    robot = Robot("robot", bodies, tuple(joints), _mimics(model), gravity, _sources(model, names))
    laws = {"SPRING": "stiffness", "DAMPER": "damping", "FRICTIONLOSS": "friction"}
    return robot.with_joints(**{law: 0.0 for flag, law in laws.items() if _off(model, flag)})


def body_of(model: Any, index: int, name: str) -> RobotBody:
    """One of MuJoCo's bodies, in its own frame."""
    A = matrix(model.body_iquat[index])
    inertia = A @ np.diag(model.body_inertia[index]) @ A.T
    return RobotBody(name, float(model.body_mass[index]), np.array(model.body_ipos[index]), inertia)


def _off(model: Any, flag: str) -> bool:
    """True if the file disables a part of the physics; MuJoCo up to 3.3 has one flag for springs and dampers."""
    bits = mujoco.mjtDisableBit
    name = "PASSIVE" if flag in {"SPRING", "DAMPER"} and not hasattr(bits, f"mjDSBL_{flag}") else flag
    return bool(model.opt.disableflags & int(getattr(bits, f"mjDSBL_{name}")))


def _sources(model: Any, names: list[str]) -> dict[str, dict[str, Any]]:
    """Body -> its pose in the file, and whether each of its shapes, in the file's order, collides with anything."""
    sources: dict[str, dict[str, Any]] = {
        names[index]: {
            "collides": [],
            "position": np.array(model.body_pos[index]),
            "rotation": matrix(model.body_quat[index]),
        }
        for index in range(1, model.nbody)
    }
    for index in range(model.ngeom):
        name = names[int(model.geom_bodyid[index])]
        if name in sources:
            sources[name]["collides"].append(bool(model.geom_contype[index] or model.geom_conaffinity[index]))
    return sources


def _joint(
    model: Any, index: int, parent: str, child: str, position: Array, rotation: Array, driven: bool
) -> RobotJoint:
    kind = _KINDS[int(model.jnt_type[index])]
    dof, start = int(model.jnt_dofadr[index]), int(model.jnt_qposadr[index])
    anchor = np.array(model.jnt_pos[index]) * (kind != "free")
    shift = float(model.qpos0[start]) * (kind in {"revolute", "prismatic"})
    bounded = bool(model.jnt_limited[index]) and kind in {"revolute", "prismatic"}
    return RobotJoint(
        model.joint(index).name, kind, parent, child,
        position + rotation @ anchor if kind != "free" else np.zeros(3),
        rotation if kind != "free" else np.eye(3),
        np.array(model.jnt_axis[index]), anchor,
        damping=_first(model.dof_damping[dof]),
        friction=float(model.dof_frictionloss[dof]),
        armature=float(model.dof_armature[dof]),
        stiffness=_first(model.jnt_stiffness[index]),
        rest=float(model.qpos_spring[start]) - shift,
        lower=float(model.jnt_range[index, 0]) - shift if bounded else None,
        upper=float(model.jnt_range[index, 1]) - shift if bounded else None,
        actuated=driven,
    )  # fmt: skip


def _mimics(model: Any) -> tuple[Mimic, ...]:
    """Linear couplings of joints; others are constraints that the comparison leaves out."""
    mimics, coupling = [], int(mujoco.mjtEq.mjEQ_JOINT)
    for index in range(model.neq):
        first, other = int(model.eq_obj1id[index]), int(model.eq_obj2id[index])
        factors = model.eq_data[index][:5]
        if model.eq_type[index] == coupling and other >= 0 and model.eq_active0[index] and not np.any(factors[2:]):
            mimics.append(Mimic(model.joint(first).name, model.joint(other).name, float(factors[1]), float(factors[0])))
    return tuple(mimics)


def _first(value: Any) -> float:
    """The linear coefficient, where a version of MuJoCo has a polynomial."""
    return float(np.ravel(value)[0])


def matrix(quaternion: Array) -> Array:
    """The rotation of a quaternion of MuJoCo's."""
    return np.asarray(Rotation.from_quat(quaternion, scalar_first=True).as_matrix())
