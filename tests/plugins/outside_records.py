"""Records of a robot in the air that programs write without proofroll: MuJoCo alone, and Pinocchio with own steps.

The loop around both is written for itself, with the mistakes that people make in it.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

JOINTS = ("FL_HAA", "FL_HFE", "FL_KFE", "FR_HAA", "FR_HFE", "FR_KFE")
POSE = np.array([0.1, 0.7, -1.4, 0.1, 0.7, -1.4])
CENTRE = (0.02, 0.0, 0.01)  # of the trunk
KP, KD, SCALE, ARMATURE, EFFORT, RATE = 5.0, 0.2, 0.25, 1e-3, 0.8, 50
OFFSET = 0.15 * np.array([1.0, -1.0, 1.0, 1.0, -1.0, -1.0])
QUATERNION = np.array([0.9, 0.3, -0.2, 0.25]) / np.linalg.norm([0.9, 0.3, -0.2, 0.25])
VELOCITY, SPIN = np.array([0.2, -0.1, 0.3]), np.array([0.3, -0.4, 0.9])  # in the world, in the body

_LINK = """<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
<inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
_JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{name}_link"/>
<origin xyz="{place}"/><axis xyz="{axis}"/><limit lower="-3" upper="3" effort="0.8" velocity="40"/></joint>
<transmission name="{name}_drive"><type>simple</type><joint name="{name}"/>
<actuator name="{name}_motor"><mechanicalReduction>9</mechanicalReduction></actuator></transmission>"""


def urdf() -> str:
    """A trunk with two legs of three joints, whose efforts are limited to 0.8 N m behind reductions of 9."""
    parts = [_LINK.format(name="trunk", com="0.02 0 0.01", mass=2, x=0.02, y=0.03, z=0.04)]
    for leg, side in (("FL", 0.1), ("FR", -0.12)):
        parent, place = "trunk", f"0.15 {side} 0"
        for part, axis in (("HAA", "1 0 0"), ("HFE", "0 1 0"), ("KFE", "0 1 0")):
            name = f"{leg}_{part}"
            parts.append(_JOINT.format(name=name, parent=parent, place=place, axis=axis))
            parts.append(_LINK.format(name=f"{name}_link", com="0 0.01 -0.08", mass=0.3, x=2e-3, y=2.1e-3, z=6e-4))
            parent, place = f"{name}_link", "0 0.02 -0.16"
    return f'<robot name="legs">{"".join(parts)}</robot>'


CONTROL = f"""rate = {RATE}
pose = {{"FL_HAA" = 0.1, FL_HFE = 0.7, FL_KFE = -1.4, FR_HAA = 0.1, FR_HFE = 0.7, FR_KFE = -1.4}}
[[gains]]
joints = "*"
kp = {KP}
kd = {KD}
armature = {ARMATURE}
[policy]
call = "proofroll.robots.probe:make"
scale = {SCALE}
"""


@dataclass
class Loop:
    """Somebody's loop around a simulator; every attribute but the first two is a mistake unless it has its default."""

    step: float = 1e-3
    steps: int = 100
    to_joint: Sequence[int] = range(6)
    seen: Sequence[int] = range(6)
    pose: np.ndarray = field(default_factory=POSE.copy)
    kp: float | np.ndarray = KP
    kd: float | np.ndarray = KD
    scale: float | np.ndarray = SCALE
    more_steps: int = 0
    late: int = 0
    limit: float | np.ndarray = EFFORT
    armature: float = ARMATURE
    xyzw: bool = False
    gravity_sign: float = -1.0
    body_velocity: bool = False
    world_spin: bool = False
    signs: np.ndarray = field(default_factory=lambda: np.ones(6))
    lag: int = 0
    gravity: float = 9.81
    periods: float = 1.0
    repeated: int = -1
    back: bool = False
    velocity_back: bool = False
    spin_back: bool = False
    at_centre: bool = False
    factors: Mapping[str, float] = field(default_factory=dict)
    relative: bool = False
    hold: bool = False
    smoothing: float = 1.0
    clip: float = np.inf
    raw: bool = False
    damping: float = 0.0
    friction: float = 0.0
    payload: float = 0.0
    bias: float = 0.0
    late_effort: bool = False
    meaning: str = ""
    shift: int = 0
    conjugated: bool = False
    see_before: bool = False
    seen_gravity: float = 1.0
    seen_signs: np.ndarray = field(default_factory=lambda: np.ones(6))
    ramp: str = ""
    no_load_speed: float = np.inf
    late_steps: int = 0
    normalised: bool = False
    exchanged: Sequence[str] = ()

    def record(self, program: Callable[[Loop], Simulator]) -> dict[str, np.ndarray]:
        """Columns over time of a run, each named as in the documentation."""
        from proofroll.elements.mechanism.scene.policy import Observation
        from proofroll.robots.probe import make

        sim, act, rows = program(self), make(JOINTS), []
        action, counts, queue = np.zeros(6), np.zeros(6), [POSE.copy() for _ in range(self.late)]
        period = round(self.periods / RATE / self.step) + self.more_steps
        before, answers, goal = sim.state(), list[np.ndarray](), POSE
        factor = {key: self.factors.get(key, 1.0) for key in ("q", "v", "v_WB_W", "w_WB_B", "last")}
        for k in range(self.steps + 1):
            now = state = sim.state()
            if k % period == 0 and k != self.repeated * period:
                state = before if self.see_before else now
                quaternion = state["q_WB"] * [1, -1, -1, -1] if self.conjugated else state["q_WB"]
                quaternion = np.roll(quaternion, -1 if self.xyzw else self.shift)
                R, body = _matrix(quaternion), _matrix(state["q_WB"])
                R = R.T if self.back else R
                velocity, spin = state["v_WB"], body.T @ state["w_WB"]
                if self.at_centre:
                    velocity = velocity + np.cross(state["w_WB"], body @ np.array(CENTRE))
                velocity = body.T @ velocity if self.body_velocity else velocity
                velocity = body @ velocity if self.velocity_back else velocity
                spin = state["w_WB"] if self.world_spin else body.T @ spin if self.spin_back else spin
                places = state["q"] - POSE if self.relative else state["q"]
                seen = {
                    "q": self.seen_signs * factor["q"] * places[list(self.seen)],
                    "v": factor["v"] * (state["v"] / 1.7 - 0.2 if self.normalised else state["v"])[list(self.seen)],
                    "v_WB_W": factor["v_WB_W"] * velocity,
                    "w_WB_B": factor["w_WB_B"] * spin,
                    "gravity_B": self.seen_gravity * (R.T @ np.array([0, 0, self.gravity_sign])),
                }
                seen |= {name: seen[other] for name, other in zip(self.exchanged, self.exchanged[::-1], strict=True)}
                state, last = now, factor["last"] * action
                previous, action = (
                    action,
                    act(Observation(time=k * self.step, p_WB=state["p_WB"], R_WB=R, last=last, **seen)),
                )
                clipped = np.clip(action, -self.clip, self.clip)
                action = action if self.raw else clipped
                counts = clipped if self.meaning == "filtered" and not k else counts
                counts = counts + (0.3 if self.meaning == "filtered" else self.smoothing) * (clipped - counts)
                placed = np.zeros(6)
                placed[list(self.to_joint)] = {
                    "mixed": (clipped + previous) / 2,
                    "squashed": np.tanh(counts),
                }.get(self.meaning, counts)
                pose = state["q"] if self.meaning == "added" else self.pose
                queue.append(self.signs * (pose + self.scale * placed))
                target = queue.pop(0)
            servo, held = before if self.lag else state, target
            if self.ramp:
                if k % period == 0:
                    begin, goal = goal, target
                held = begin + (goal - begin) * (k % period + 1) / period
                target = held if self.ramp == "recorded" else goal
            if self.late_steps:
                held = rows[-self.late_steps]["target"] if k >= self.late_steps else POSE
            if not self.hold or k % period == 0:
                answered = np.clip(self.kp * (held - servo["q"]) - self.kd * servo["v"], -self.limit, self.limit)
                fallen = EFFORT * (1 - np.sign(answered) * servo["v"] / self.no_load_speed)
                if np.isfinite(self.no_load_speed):
                    answered = np.sign(answered) * np.minimum(np.abs(answered), np.maximum(fallen, 0.0))
                answers.append(answered + self.bias)
                effort = answers[-2] if self.late_effort and k else answers[-1]
            row = {"time": np.array([k * self.step]), **state, **{f"observed.{key}": seen[key] for key in seen}}
            rows.append({**row, "action": action, "target": target, "effort": effort})
            before = state
            lost = self.damping * state["v"] + self.friction * np.sign(state["v"])
            sim.step(effort - lost, target)
        return {key: np.array([row[key] for row in rows]) for key in rows[0]}


class Simulator(Protocol):
    """Needs of a loop around a simulator."""

    def state(self) -> Mapping[str, np.ndarray]:
        """``q``, ``v``, ``p_WB``, ``q_WB`` (scalar first), ``v_WB`` and ``w_WB`` in world axes."""

    def step(self, effort: np.ndarray, target: np.ndarray) -> None:
        """Moves on by one step under efforts at the joints, or under servos that follow targets."""


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class MujocoAlone:
    """MuJoCo with its Euler method."""

    def __init__(self, loop: Loop) -> None:
        import mujoco

        self.mujoco = mujoco
        spec = mujoco.MjSpec.from_string(urdf())
        spec.worldbody.first_body().add_freejoint()
        spec.option.timestep, spec.option.gravity = loop.step, [0, 0, -loop.gravity]
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        for joint in spec.joints:
            if joint.type == mujoco.mjtJoint.mjJNT_HINGE:
                joint.armature, joint.actfrclimited = loop.armature, 0
        if loop.payload:
            mass = spec.worldbody.first_body().add_body(name="payload", pos=[0.1, 0.05, 0.12])
            mass.mass, mass.inertia, mass.ipos, mass.explicitinertial = loop.payload, [1e-9] * 3, [0, 0, 0], True
        self.add_servos(spec, loop)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = [0, 0, 1, *QUATERNION, *(POSE + OFFSET)]
        self.data.qvel[:] = [*VELOCITY, *SPIN, *np.zeros(6)]
        mujoco.mj_forward(self.model, self.data)

    def add_servos(self, spec: Any, loop: Loop) -> None:
        """Adds nothing: the loop computes efforts."""

    def state(self) -> Mapping[str, np.ndarray]:
        """See :class:`Simulator`."""
        q, v = self.data.qpos.copy(), self.data.qvel.copy()
        spin = _matrix(q[3:7]) @ v[3:6]
        return {"q": q[7:], "v": v[6:], "p_WB": q[:3], "q_WB": q[3:7], "v_WB": v[:3], "w_WB": spin}

    def step(self, effort: np.ndarray, target: np.ndarray) -> None:  # noqa: ARG002 -- one of the two counts
        """See :class:`Simulator`."""
        self.data.qfrc_applied[6:] = effort
        self.mujoco.mj_step(self.model, self.data)


class MujocoServos(MujocoAlone):
    """MuJoCo with its own position actuators, whose damping it takes implicitly."""

    def add_servos(self, spec: Any, loop: Loop) -> None:
        """Adds a position actuator with a limit at every joint."""
        spec.option.integrator = self.mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        for name in JOINTS:
            servo = spec.add_actuator(name=name, target=name, trntype=self.mujoco.mjtTrn.mjTRN_JOINT)
            servo.gainprm[0], servo.biasprm[1:3] = loop.kp, [-loop.kp, -loop.kd]
            servo.biastype = self.mujoco.mjtBias.mjBIAS_AFFINE
            if np.isfinite(loop.limit):
                servo.forcelimited, servo.forcerange = 1, [-loop.limit, loop.limit]

    def step(self, effort: np.ndarray, target: np.ndarray) -> None:  # noqa: ARG002 -- one of the two counts
        """See :class:`Simulator`."""
        self.data.ctrl[:] = target
        self.mujoco.mj_step(self.model, self.data)


class PinocchioAlone:
    """Accelerations of Pinocchio's articulated bodies, integrated by a semi-implicit Euler method of our own."""

    def __init__(self, loop: Loop) -> None:
        import pinocchio

        self.pin = pinocchio
        self.model = pinocchio.buildModelFromXML(urdf(), pinocchio.JointModelFreeFlyer())
        self.model.armature = np.array([*np.zeros(6), *np.full(6, loop.armature)])
        self.model.gravity.linear = np.array([0, 0, -loop.gravity])
        if loop.payload:
            place = np.array([0.1, 0.05, 0.12])
            self.model.inertias[1] += pinocchio.Inertia(loop.payload, place, np.zeros((3, 3)))
        self.data, self.h = self.model.createData(), loop.step
        x, y, z, w = *QUATERNION[1:], QUATERNION[0]
        self.q = np.array([0, 0, 1, x, y, z, w, *(POSE + OFFSET)])
        self.v = np.array([*(_matrix(QUATERNION).T @ VELOCITY), *SPIN, *np.zeros(6)])

    def state(self) -> Mapping[str, np.ndarray]:
        """See :class:`Simulator`."""
        quaternion = np.roll(self.q[3:7], 1)
        R = _matrix(quaternion)
        names = [self.model.joints[self.model.getJointId(name)] for name in JOINTS]
        q, v = np.array([self.q[item.idx_q] for item in names]), np.array([self.v[item.idx_v] for item in names])
        return {
            "q": q, "v": v, "p_WB": self.q[:3].copy(), "q_WB": quaternion,
            "v_WB": R @ self.v[:3], "w_WB": R @ self.v[3:6],
        }  # fmt: skip

    def step(self, effort: np.ndarray, target: np.ndarray) -> None:  # noqa: ARG002 -- one of the two counts
        """See :class:`Simulator`."""
        acceleration = self.pin.aba(self.model, self.data, self.q, self.v, np.array([*np.zeros(6), *effort]))
        self.v = self.v + self.h * acceleration
        self.q = self.pin.integrate(self.model, self.q, self.h * self.v)


PROGRAMS: Mapping[str, Callable[[Loop], Simulator]] = {"mujoco": MujocoAlone, "pinocchio": PinocchioAlone}
SERVOS: Mapping[str, Callable[[Loop], Simulator]] = {"mujoco's servos": MujocoServos}
# Mistake -> its id, the layer at which a record shows it, and the attributes of a loop that makes it.
MISTAKES: Mapping[str, tuple[str, str, dict[str, Any]]] = {
    "legs swapped": ("joint_order", "target", {"to_joint": (3, 4, 5, 0, 1, 2)}),
    "place by place": ("joint_order", "target", {"to_joint": (0, 3, 1, 4, 2, 5)}),
    "order in the observation": ("observed_order", "observation", {"seen": (3, 4, 5, 0, 1, 2)}),
    "pose missing": ("pose_missing", "target", {"pose": 0 * POSE}),
    "pose off": ("pose", "target", {"pose": POSE + np.array([0.1, -0.2, 0.1, -0.2, 0.1, -0.2])}),
    "half kp": ("kp", "effort", {"kp": 0.5 * KP}),
    "kp + 10 %": ("kp", "effort", {"kp": 1.1 * KP}),
    "half kd": ("kd", "effort", {"kd": 0.5 * KD}),
    "kd + 10 %": ("kd", "effort", {"kd": 1.1 * KD}),
    "double scale": ("scale", "target", {"scale": 2 * SCALE}),
    "half scale": ("scale", "target", {"scale": 0.5 * SCALE}),
    "a step more": ("decimation", "instants", {"more_steps": 1}),
    "a step less": ("decimation", "instants", {"more_steps": -1}),
    "an instant late": ("late", "target", {"late": 1}),
    "no clamp": ("clamp_missing", "effort", {"limit": np.inf}),
    "half the clamp": ("clamp", "effort", {"limit": 0.5 * EFFORT}),
    "no armature": ("armature", "acceleration", {"armature": 0.0}),
    "xyzw": ("quaternion", "observation", {"xyzw": True}),
    "sign of gravity": ("gravity_sign", "observation", {"gravity_sign": 1.0}),
    "velocity in the base": ("velocity_frame", "observation", {"body_velocity": True}),
    "spin in the world": ("spin_frame", "observation", {"world_spin": True}),
    "sign of a joint": ("joint_sign", "target", {"signs": np.array([1.0, -1, 1, 1, 1, 1])}),
    "state before": ("state_before", "effort", {"lag": 1}),
    "gravity 9.80": ("gravity", "acceleration", {"gravity": 9.80}),
    "gravity upwards": ("gravity", "acceleration", {"gravity": -9.81}),
    "half of kd, other sign": ("kd", "effort", {"kd": -0.5 * KD, "steps": 60}),
    "no gravity": ("gravity", "acceleration", {"gravity": 0.0}),
    "half the rate": ("rate", "instants", {"periods": 2}),
    "a quarter of the rate": ("rate", "instants", {"periods": 4, "steps": 200}),
    "twice the rate": ("rate", "instants", {"periods": 0.5}),
    "four times the rate": ("rate", "instants", {"periods": 0.25}),
    "an action repeated": ("repeated", "instants", {"repeated": 2}),
    "two instants late": ("late", "target", {"late": 2, "steps": 200}),
    "breadth first, back": ("joint_order", "target", {"to_joint": (0, 2, 4, 1, 3, 5)}),
    "rotation back": ("rotation", "observation", {"back": True}),
    "velocity back": ("velocity_frame", "observation", {"velocity_back": True}),
    "spin back": ("spin_frame", "observation", {"spin_back": True}),
    "velocity of the centre": ("velocity_point", "observation", {"at_centre": True}),
    "rates at 0.05": ("observed_v", "observation", {"factors": {"v": 0.05}}),
    "spin at 0.25": ("observed_w_WB_B", "observation", {"factors": {"w_WB_B": 0.25}}),
    "velocity at 2": ("observed_v_WB_W", "observation", {"factors": {"v_WB_W": 2.0}}),
    "relative coordinates": ("observed_pose", "observation", {"relative": True}),
    "no last action": ("observed_last", "action", {"factors": {"last": 0.0}}),
    "half of the last action": ("observed_last", "action", {"factors": {"last": 0.5}}),
    "held efforts": ("held_effort", "effort", {"hold": True}),
    "low pass": ("smoothing", "target", {"smoothing": 0.3}),
    "clipped actions": ("action_clip", "action", {"clip": 0.2}),
    "clipped targets": ("action_clip", "target", {"clip": 0.2, "raw": True}),
    "damping": ("damping", "acceleration", {"damping": 0.02}),
    "dry friction": ("friction", "acceleration", {"friction": 0.03}),
    "payload": ("payload", "acceleration", {"payload": 0.15}),
    "terms in another order": ("observed_terms", "observation", {"exchanged": ("w_WB_B", "gravity_B")}),
}
ONE, HIPS = np.arange(6) == 2, np.array([True, False, False, True, False, False])  # FL_KFE; FL_HAA and FR_HAA
# Mistake -> its id, layer, attributes of a loop, and what is said of it: numbers of single joints, and others that a
# fit finds.
FITTED: Mapping[str, tuple[str, str, dict[str, Any], str]] = {
    "kp of a joint": ("servo", "effort", {"kp": KP * np.where(ONE, 1.3, 1)}, "kp is another: FL_KFE 1.3 of"),
    "kd of hips": ("servo", "effort", {"kd": KD * np.where(HIPS, 0.5, 1)}, "kd is another: FL_HAA, FR_HAA 0.5 of"),
    "kp and kd": ("servo", "effort", {"kp": 0.8 * KP, "kd": 1.5 * KD}, "kp is 0.8 of the right one; kd is 1.5 of"),
    "a clamp": (
        "servo",
        "effort",
        {"limit": EFFORT * np.where(ONE, 0.4, 1)},
        "the limit of efforts is another: FL_KFE",
    ),
    "bias": (
        "servo",
        "effort",
        {"bias": 0.04},
        "beside the servo's: FL_HAA, FL_HFE, FL_KFE, FR_HAA, FR_HFE, FR_KFE 0.04",
    ),
    "sign of kd": ("kd_sign", "effort", {"kd": -KD, "steps": 60}, "kd has the other sign"),
    "a step late": ("late_effort", "effort", {"late_effort": True}, "efforts are those of the row before"),
    "scale of a joint": (
        "affine_target",
        "target",
        {"scale": SCALE * np.where(ONE, 0.5, 1)},
        "FL_KFE 0.5 of the right",
    ),
    "scale and pose": ("affine_target", "target", {"scale": 0.7 * SCALE, "pose": POSE + 0.1 * ONE}, "FL_KFE +0.1"),
    "sign of actions": ("scale", "target", {"scale": -SCALE}, "the scale of actions has the other sign"),
    "low pass from the first": ("smoothing", "target", {"meaning": "filtered"}, "of which 0.3 is new at each instant"),
    "mixed": ("mixed_actions", "target", {"meaning": "mixed"}, "mix 0.5 of an action with 0.5 of the one before"),
    "squashed": ("squashed", "target", {"meaning": "squashed"}, "actions pass a tanh"),
    "added": ("added", "target", {"meaning": "added"}, "actions are added to the present coordinates"),
    "first for last": ("quaternion", "observation", {"shift": 1}, "is read as x, y, z, w, and is w, x, y, z"),
    "last of the inverse": ("quaternion", "observation", {"shift": -1, "conjugated": True}, "of the inverse rotation"),
    "last, turned back": ("quaternion", "observation", {"shift": -1, "back": True}, "used as the inverse rotation"),
    "gravity in m/s²": ("observed_gravity", "observation", {"seen_gravity": 9.81}, "gravity is observed at 9.81 of"),
    "an observation late": ("observed_before", "observation", {"see_before": True}, "the state of the step before"),
    "ramped": (
        "ramped",
        "target",
        {"ramp": "recorded"},
        "targets go along a straight line from one instant to the next",
    ),
    "ramped in the servo": ("ramped", "effort", {"ramp": "hidden"}, "servos follow targets along a straight line"),
    "motor": ("falling_limit", "effort", {"no_load_speed": 8.0}, "along them: 0.8 at rest, 0 at a speed of 8"),
    "steps late": ("late_rows", "effort", {"late_steps": 3}, "targets act 3 rows late"),
    "normalised": ("observed_normalised", "observation", {"normalised": True}, "0.58824 of the right one; constants: "),
    "sign of a coordinate": ("observed_size", "observation", {"seen_signs": np.where(ONE, -1.0, 1)}, "q.FL_KFE -1 of"),
}
# Mistakes of observations, which show at the action where no observation is recorded.
OBSERVED = tuple(name for name, (_, layer, _) in MISTAKES.items() if layer == "observation")


def columns_of(record: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns with the names of the documentation."""
    found = {}
    for key, values in record.items():
        width = values.shape[1]
        labels = JOINTS if width == 6 else "wxyz" if width == 4 else "xyz"
        found |= {"time": values[:, 0]} if width == 1 else {f"{key}.{labels[k]}": values[:, k] for k in range(width)}
    return found


def written(columns: Mapping[str, np.ndarray], path: Path, digits: str = "") -> Path:
    """A CSV of columns: with all digits, in ``single`` precision, or with a number of decimals."""

    def text(name: str, value: float) -> str:
        if name == "time":
            return f"{value:.9g}"
        if digits == "single":
            return str(np.float32(value))
        return f"{value:.{digits}f}" if digits else repr(float(value))

    names = list(columns)
    rows = zip(*(columns[name].tolist() for name in names), strict=True)
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([names, *([text(*pair) for pair in zip(names, row, strict=True)] for row in rows)])
    return path


_IN_BASE = {name: f"{name} is along the axes of the base" for name in ("v_WB", "w_WB")}


def miswritten(record: Mapping[str, np.ndarray], name: str) -> dict[str, np.ndarray]:
    """A record with a mistake of its columns, one of :data:`MISWRITTEN`."""
    q, v, attitude = record["q"], record["v"], record["q_WB"]
    bodies = np.array([_matrix(row) for row in attitude])
    in_base = {kind: np.einsum("tji,tj->ti", bodies, record[kind]) for kind in _IN_BASE}
    changed = {
        "q and v": {"q": v, "v": q},
        "degrees": {"q": np.degrees(q)},
        "degrees per second": {"v": np.degrees(v)},
        "all in degrees": {"q": np.degrees(q), "v": np.degrees(v)},
        "late rates": {"v": np.concatenate([v[:1], v[:-1]])},
        "late spin": {"w_WB": np.concatenate([record["w_WB"][:1], record["w_WB"][:-1]])},
        "early velocities": {kind: record[kind][[*range(1, len(v)), -1]] for kind in ("v", "v_WB", "w_WB")},
        "late velocity": {"v_WB": np.concatenate([record["v_WB"][:1], record["v_WB"][:-1]])},
        "sign of rates": {"v": -v},
        "sign of coordinates": {"q": -q},
        "sign of spins": {"w_WB": -record["w_WB"]},
        "inverse, w_WB in base": {"q_WB": attitude * [1, -1, -1, -1], "w_WB": in_base["w_WB"]},
        "milliseconds": {"time": 1e3 * record["time"]},
        "scalar last": {"q_WB": np.roll(attitude, -1, axis=1)},
        "inverse": {"q_WB": attitude * [1, -1, -1, -1]},
        "centre": {"v_WB": record["v_WB"] + np.cross(record["w_WB"], bodies @ np.array(CENTRE))},
        "v_WB": {"v_WB": in_base["v_WB"]},
        "w_WB": {"w_WB": in_base["w_WB"]},
        "scaled actions": {"action": SCALE * record["action"]},
        "targets as actions": {"action": POSE + SCALE * record["action"]},
        "late actions": {"action": np.concatenate([np.zeros((20, 6)), record["action"][:-20]])},
        "other legs": {"effort": record["effort"][:, [3, 4, 5, 0, 1, 2]]},
        "sign of efforts": {"effort": -record["effort"]},
    }
    return {**record, **changed[name]}


# Mistake of columns -> its layer, and what is said of it.
MISWRITTEN: Mapping[str, tuple[str, str]] = {
    "q and v": ("state", "the columns q.JOINT and v.JOINT are each the other"),
    "degrees": ("state", "q.JOINT is in degrees"),
    "degrees per second": ("state", "v.JOINT is in degrees per second"),
    "all in degrees": ("state", "q.JOINT and v.JOINT are in degrees"),
    "late rates": ("state", "v.JOINT is one row late (places off by "),
    "late spin": ("state", "w_WB is one row late (places off by "),
    "early velocities": ("state", "v.JOINT, v_WB, w_WB: one row early"),
    "late velocity": ("state", "v_WB is one row late (places off by 9.6e-4, by "),
    "sign of rates": ("state", "v.JOINT has the other sign"),
    "sign of coordinates": ("state", "q.JOINT has the other sign"),
    "sign of spins": ("state", "w_WB has the other sign"),
    "inverse, w_WB in base": ("state", "q_WB is of the inverse rotation, of the world in the base, and w_WB is along"),
    "milliseconds": ("state", "the times are in milliseconds"),
    "scalar last": ("state", "q_WB is x, y, z, w under the names of w, x, y, z"),
    "inverse": ("state", "q_WB is of the inverse rotation"),
    "centre": ("state", "v_WB is the velocity of the base's centre of mass"),
    **{name: ("state", words) for name, words in _IN_BASE.items()},
    "scaled actions": ("action", "the columns of actions have the scale of the controller already"),
    "targets as actions": ("action", "the columns of actions are targets"),
    "late actions": ("action", "the columns of actions are one instant late"),
    "other legs": ("effort", "efforts are of joints in another order (FL and FR swapped)"),
    "sign of efforts": ("effort", "efforts have the other sign"),
}
