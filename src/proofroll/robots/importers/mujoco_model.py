"""Actuators of a model that MuJoCo compiled, and its shapes that come near each other in a run, as plain data."""

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from proofroll.robots.model import Array, RobotActuator
from proofroll.robots.protocol import WATCHED, lift

# Values of an actuator that are read here, that act on no force, and that act beside a dyntype alone; all others must
# be those of a plain motor.
_READ = {"armature", "biasprm", "biastype", "ctrllimited", "ctrlrange", "damping", "gainprm", "gear", "group"}
_READ |= {"forcelimited", "forcerange", "trnid", "trntype"}
_WITHOUT_FORCE = {"acc0", "ctrladr", "ctrlspec", "historyadr", "length0", "lengthrange", "outadr", "user"}
_OF_ACTIVATION = {"actadr", "actearly", "actlimited", "actnum", "actrange", "dynprm"}
_MOTOR = "<mujoco><worldbody><body><joint name='j'/><geom size='1'/></body></worldbody>{}</mujoco>"
_NAMED = {"dyntype": mujoco.mjtDyn, "gaintype": mujoco.mjtGain}
_SCALAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
# Distance that counts as near, and the largest one between a floor and the lowest shape above it [m].
_NEAR, _HIGH = 0.02, 10.0
# Largest number of steps of the run times velocities.
_MOST = 2e5
# Cosine between the normals of a contact and of a face from which on the contact is one of this face (MuJoCo may give
# that of the other face of almost parallel ones), and way of its place from the border of the face [m].
_UPRIGHT, _WITHIN = 0.99, 1e-3
_KINDS = {
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{name.upper()}")): name.lower().replace("hfield", "height field")
    for name in ("plane", "sphere", "capsule", "box", "cylinder", "ellipsoid", "mesh", "hfield", "sdf")
}


def near_shapes(
    path: Path,
    start: Mapping[str, Sequence[float]],
    servos: Mapping[str, tuple[float, float, Sequence[float], float]],
    base_joint: str,
    floor: bool,
    drop: float | None,
    motion: Mapping[str, Sequence[Sequence[float]]],
) -> dict[str, Any]:
    """Shapes that come nearer than 2 cm to another one within a second, as plain data.

    The robot starts in a state at rest, its lowest shape above the floor, and springs and dampers hold its joints.

    Args:
        path: of an MJCF, or of a URDF without meshes.
        start: joint -> coordinates: those of one axis from the file's pose [rad or m], a quaternion, a place and one.
        servos: joint -> gains kp and kd, targets from the file's pose at equal intervals of the second, armature.
        base_joint: name of the joint that frees the root of a URDF; empty: nothing does.
        floor: True for a floor z = 0 in place of the file's planes; each shape that collides with any collides with it.
        drop: height of the lowest shape over the floor [m]; None: as it is, or 1 cm where it overlaps the floor.
        motion: joint -> coordinates as in ``start`` in each state of a motion in place of that second; empty: none.

    Returns:
        ``shapes`` as by :func:`_shape`; ``pairs`` with the numbers of two ``shapes``, their laws, the least
        ``distance`` [m] and that at the ``start``, the first step or state in which they ``met`` (-1: they did not),
        and the ``face`` of a box by :func:`_face`.
    """
    model = _compiled(path, base_joint, floor=floor)
    data = mujoco.MjData(model)
    _put(model, data, start, servos)
    _lift(model, data, drop)
    found: dict[tuple[int, int], dict[str, Any]] = {}
    _widen(model.geom_gap, model.geom_margin, _NEAR / 2 if _gap_widens() else _NEAR)
    _widen(model.pair_gap, model.pair_margin, _NEAR)
    places = [int(model.joint(name).qposadr[0]) for name in servos]
    steps = min(int(WATCHED / model.opt.timestep), int(_MOST / max(model.nv, 1)))
    for step in range(len(next(iter(motion.values()))) if motion else steps):
        for place, (_, _, targets, _) in zip(places, servos.values(), strict=True):
            model.qpos_spring[place] = model.qpos0[place] + targets[int(len(targets) * data.time / WATCHED)]
        _pose(model, data, {name: states[step] for name, states in motion.items()})
        (mujoco.mj_fwdPosition if motion else mujoco.mj_step)(model, data)
        if not np.isfinite(data.qacc).all() or data.warning[int(mujoco.mjtWarning.mjWARN_BADQACC)].number:
            break
        for contact in data.contact[: data.ncon]:
            first, second = sorted(contact.geom.tolist())
            face = _face(model, data, contact)
            as_combined = {
                "dim": int(contact.dim),
                "friction": contact.friction.tolist(),
                "softness": contact.solref.tolist(),
                "margin": float(contact.includemargin),
            }
            unseen = {"distance": float(contact.dist), "face": face, "start": _NEAR, "met": -1}
            laws = found.setdefault((first, second), as_combined | unseen)
            if laws["met"] < 0 and contact.dist <= max(contact.includemargin, 0.0):
                laws["met"] = step
            laws["distance"] = min(laws["distance"], float(contact.dist))
            laws["face"] = face if laws["face"] == face else []
            laws["start"] = laws["start"] if step else min(laws["start"], float(contact.dist))
    geoms = sorted({geom for pair in found for geom in pair})
    pairs = [{"shapes": [geoms.index(geom) for geom in pair]} | laws for pair, laws in sorted(found.items())]
    return {"shapes": [_shape(model, geom) for geom in geoms], "pairs": pairs}


def _face(model: Any, data: Any, contact: Any) -> list[int]:
    """Axis and side of the face of a box of the world that another shape meets within its borders; empty: it does not.

    The normal of such a contact is that of the face.
    """
    for geom, sign in zip(contact.geom.tolist(), (1, -1), strict=True):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX and not model.body_weldid[model.geom_bodyid[geom]]:
            axes, half = data.geom_xmat[geom].reshape(3, 3), model.geom_size[geom]
            normal, place = sign * contact.frame[:3] @ axes, (contact.pos - data.geom_xpos[geom]) @ axes
            axis = int(np.argmax(np.abs(normal)))
            beyond = np.delete(np.abs(place) - half, axis).max()
            if abs(normal[axis]) > _UPRIGHT and beyond < -_WITHIN:
                return [axis, int(np.sign(normal[axis]))]
    return []


def _compiled(path: Path, base_joint: str, *, floor: bool) -> Any:
    """Model of a file; masses too small for MuJoCo are raised, as shapes alone are read."""
    text = path.read_text(encoding="utf-8")
    if "</robot>" in text:
        compiler = '<mujoco><compiler fusestatic="false" balanceinertia="true" discardvisual="true"/></mujoco>'
        at_end = text.rindex("</robot>")
        spec = mujoco.MjSpec.from_string(f"{text[:at_end]}{compiler}{text[at_end:]}")
    else:
        spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.boundmass, spec.compiler.boundinertia = 1e-6, 1e-9
    if base_joint:
        spec.worldbody.bodies[0].add_freejoint().name = base_joint
    if floor:
        every = 2**31 - 1
        floors = [geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_PLANE]
        pairs = [pair for pair in spec.pairs if {pair.geomname1, pair.geomname2} & {geom.name for geom in floors}]
        for item in (*pairs, *floors):
            spec.delete(item)
        spec.worldbody.add_geom(
            name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], contype=every, conaffinity=every
        )
    return spec.compile()


def _put(model: Any, data: Any, start: Mapping[str, Sequence[float]], servos: Mapping[str, Sequence[Any]]) -> None:
    """Sets the start, and the springs and dampers of joints in place of actuators."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
    _pose(model, data, start)
    for name, (kp, kd, _, armature) in servos.items():
        joint = model.joint(name)
        model.jnt_stiffness[joint.id] = kp
        model.dof_damping[joint.dofadr[0]] += kd
        model.dof_armature[joint.dofadr[0]] = armature


def _pose(model: Any, data: Any, coordinates: Mapping[str, Sequence[float]]) -> None:
    """Sets coordinates of joints; those of one axis count from the pose of the file."""
    for name, values in coordinates.items():
        place = int(model.joint(name).qposadr[0])
        data.qpos[place : place + len(values)] = values
        if len(values) == 1:
            data.qpos[place] += model.qpos0[place]


def _lift(model: Any, data: Any, drop: float | None) -> None:
    """Moves the first body that floats up or down until its lowest shape has its height over the floor."""
    free = np.flatnonzero(model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE))
    if not len(free):
        return
    floors = (model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)) & (model.body_weldid[model.geom_bodyid] == 0)
    gaps, margins = model.geom_gap.copy(), model.geom_margin.copy()
    _widen(model.geom_gap, model.geom_margin, _HIGH * floors)
    mujoco.mj_forward(model, data)
    root = int(model.body_rootid[model.jnt_bodyid[free[0]]])
    lowest = [
        float(contact.dist)
        for contact in data.contact[: data.ncon]
        if floors[contact.geom].any() and root in model.body_rootid[model.geom_bodyid[contact.geom]]
    ]
    model.geom_gap[:], model.geom_margin[:] = gaps, margins
    if lowest:
        data.qpos[int(model.jnt_qposadr[free[0]]) + 2] += lift(min(lowest), drop)


def _widen(gaps: Any, margins: Any, width: Any) -> None:
    """Widens the distances at which contacts are listed, without changing those at which they press."""
    gaps += width
    if not _gap_widens():
        margins += width


@cache
def _gap_widens() -> bool:
    """True if a gap is added to the margin of detection (MuJoCo 4), False if it is taken from that of pressing."""
    ball = '<body pos="0 0 .11"><freejoint/><geom size=".1" gap=".01"/></body>'
    text = f'<mujoco><worldbody><geom type="plane" size="1 1 1" gap=".01"/>{ball}</worldbody></mujoco>'
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return bool(data.ncon)


def _shape(model: Any, geom: int) -> dict[str, Any]:
    """A shape: name (empty: it has none), body (empty: the world), kind, MuJoCo's size, place and axes in the body.

    ``corners``: those of the convex hull of a mesh, in its axes [m].
    """
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.geom_quat[geom])
    body, kind = int(model.geom_bodyid[geom]), _KINDS[int(model.geom_type[geom])]
    return {
        "name": model.geom(geom).name,
        "number": geom - int(model.body_geomadr[body]),
        "body": model.body(body).name if body else "",
        "kind": kind,
        "size": model.geom_size[geom].tolist(),
        "corners": _corners(model, int(model.geom_dataid[geom])) if kind == "mesh" else [],
        "position": model.geom_pos[geom].tolist(),
        "rotation": axes.reshape(3, 3).tolist(),
    }


def _corners(model: Any, mesh: int) -> list[list[float]]:
    """Corners of the convex hull of a mesh, by which MuJoCo lets it touch."""
    first, vertices = int(model.mesh_graphadr[mesh]), model.mesh_vert[int(model.mesh_vertadr[mesh]) :]
    if first < 0:
        return []
    count = int(model.mesh_graph[first])  # it is followed by that of faces, places of edges, and numbers of corners
    numbers = model.mesh_graph[first + 2 + count : first + 2 + 2 * count]
    corners: list[list[float]] = vertices[numbers].astype(float).tolist()
    return corners


def is_off(model: Any, flag: str) -> bool:
    """True if the file disables a part of the physics; MuJoCo up to 3.3 has one flag for springs and dampers."""
    bits = mujoco.mjtDisableBit
    name = "PASSIVE" if flag in {"SPRING", "DAMPER"} and not hasattr(bits, f"mjDSBL_{flag}") else flag
    return bool(model.opt.disableflags & int(getattr(bits, f"mjDSBL_{name}")))


def reflected(model: Any, law: str, joint: int) -> float:
    """Armature or damping of all motors of a joint, reflected to it [kg m² or kg; N m s/rad or N s/m]."""
    of_joint = [index for index in range(len(model.actuator_gear)) if _joint(model, index) == joint]
    values = getattr(model, f"actuator_{law}", None)  # MuJoCo has it from version 4 on
    return 0.0 if values is None else float(model.actuator_gear[of_joint, 0] ** 2 @ values[of_joint])


def _joint(model: Any, index: int) -> int:
    """Number of the joint that an actuator drives; -1: it drives something else."""
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    return int(model.actuator_trnid[index, 0]) if int(model.actuator_trntype[index]) in kinds else -1


def actuators_of(model: Any) -> tuple[RobotActuator, ...]:
    """All actuators; those that the file switches off have no effort."""
    motor = mujoco.MjModel.from_xml_string(_MOTOR.format("<actuator><motor joint='j'/></actuator>"))
    keys = {name.removeprefix("actuator_") for name in dir(model) if name.startswith("actuator_")}
    plain = {
        key: getattr(motor, f"actuator_{key}")[0] for key in sorted(keys - _READ - _WITHOUT_FORCE - _OF_ACTIVATION)
    }
    return tuple(_actuator(model, index, plain) for index in range(len(model.actuator_gear)))


def _actuator(model: Any, index: int, plain: dict[str, Any]) -> RobotActuator:
    """An actuator; ``plain``: values that act, of a plain motor."""
    joint, gear = _joint(model, index), float(model.actuator_gear[index, 0])
    group, forces = int(model.actuator_group[index]), model.actuator_forcerange[index]
    off = is_off(model, "ACTUATION") or bool(group in range(31) and model.opt.disableactuator >> group & 1) or not gear
    bias_type = mujoco.mjtBias(int(model.actuator_biastype[index]))
    affine = bias_type == mujoco.mjtBias.mjBIAS_AFFINE
    bias, slope, slope_of_velocity = (model.actuator_biasprm[index, :3] * affine * (not off)).tolist()
    limited = bool(model.actuator_forcelimited[index])
    unlike = {
        f"transmission {mujoco.mjtTrn(int(model.actuator_trntype[index])).name[6:].lower()}": joint < 0,
        "joint of several coordinates": joint >= 0 and model.jnt_type[joint] not in _SCALAR,
        "actuatorfrcrange of two sizes": model.jnt_actfrclimited[joint] and not _even(model.jnt_actfrcrange[joint]),
        f"biastype {bias_type.name[7:].lower()}": not affine and bias_type != mujoco.mjtBias.mjBIAS_NONE,
        "biasprm, which pushes onward": max(slope, slope_of_velocity) > 0,
        "forcerange of two sizes": limited and not _even(forces),
    }
    for key, usual in plain.items():
        value = getattr(model, f"actuator_{key}")[index]
        word = _NAMED[key](int(value)).name.rpartition("_")[2].lower() if key in _NAMED else np.array2string(value)
        unlike[f"{key} {word}{', a time constant' if word.startswith('filter') else ''}"] = np.any(value != usual)
    return RobotActuator(
        name=model.actuator(index).name or f"actuator{index}",
        joint=model.joint(joint).name if joint >= 0 else "",
        gear=gear or 1.0,
        gain=0.0 if off else float(model.actuator_gainprm[index, 0]),
        bias=bias,
        kp=-slope,
        kd=-slope_of_velocity,
        ends=tuple(model.actuator_ctrlrange[index].tolist())
        if model.actuator_ctrllimited[index] and not is_off(model, "CLAMPCTRL")
        else None,
        limit=float(forces[1]) * abs(gear) if limited and not off else None,
        unlike="" if off else " and ".join(words for words, differs in unlike.items() if differs),
    )


def _even(ends: Array) -> bool:
    """True if a range of forces has one size in both directions."""
    return bool(ends[1] > 0 and ends[0] == -ends[1])
