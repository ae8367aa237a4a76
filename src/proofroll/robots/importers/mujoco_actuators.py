"""Actuators of a model that MuJoCo compiled, as plain data."""

from typing import Any

import mujoco
import numpy as np

from proofroll.robots.model import Array, RobotActuator

# Values of an actuator that are read here, that act on no force, and that act beside a dyntype alone; all others must
# be those of a plain motor.
_READ = {"armature", "biasprm", "biastype", "ctrllimited", "ctrlrange", "damping", "gainprm", "gear", "group"}
_READ |= {"forcelimited", "forcerange", "trnid", "trntype"}
_WITHOUT_FORCE = {"acc0", "ctrladr", "ctrlspec", "historyadr", "length0", "lengthrange", "outadr", "user"}
_OF_ACTIVATION = {"actadr", "actearly", "actlimited", "actnum", "actrange", "dynprm"}
_MOTOR = "<mujoco><worldbody><body><joint name='j'/><geom size='1'/></body></worldbody>{}</mujoco>"
_NAMED = {"dyntype": mujoco.mjtDyn, "gaintype": mujoco.mjtGain}
_SCALAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


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
