"""A hundred clean loops around programs as they are installed, each of another kind: none is accused."""

from __future__ import annotations

import itertools
import random
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from robot_gallery import locate
from scipy.spatial.transform import Rotation

from proofroll.robots.control.judge import judge_record

STEP, STEPS, RATE = 1e-3, 100, 50
# Programs and their schemes; MuJoCo's Euler has the damping of joints at the velocity before the step or after it.
SCHEMES = ("mujoco EULER", "mujoco EULER explicit", "mujoco IMPLICITFAST", "mujoco IMPLICIT", "mujoco RK4", "pinocchio")
DAMPINGS, PRECISIONS = (0.0, 0.02), ("float64", "float32", "3")
LAYOUTS = ("playground", "isaaclab", "isaacgym")
CONTROLLERS = ("efforts", "held targets", "policy")
# Name -> whether its base floats, sizes of efforts [N m], and kp, kd and armature under a controller.
ROBOTS = {
    "ur10": (False, np.array([8.0, 8.0, 4.0, 0.5, 0.5, 0.02]), (100.0, 8.0, 0.2)),
    "solo12": (True, np.full(12, 0.02), (2.0, 0.1, 0.02)),
}
EVERY = list(itertools.product(SCHEMES, DAMPINGS, PRECISIONS, LAYOUTS, CONTROLLERS, ROBOTS))
CHOSEN = random.Random(20).sample(EVERY, 100)
QUICK = [case for case in CHOSEN if case[0] == "mujoco EULER" and case[1:3] == (0.02, "float64")][:1]


@dataclass
class Body:
    """A robot: its file without shapes, its driven joints, and the centre of mass of its base."""

    path: Path
    floats: bool
    joints: list[str]
    centre: np.ndarray
    armature: float


def bare(name: str, damping: float, controller: str, folder: Path) -> Body:
    """A robot of a package without meshes, ranges and drives, with this damping at each joint.

    Under a controller it has the armature of its gains.
    """
    root = ElementTree.parse(locate(name)).getroot()
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    for part in [item for item in root if item.tag not in {"link", "joint"}]:
        root.remove(part)
    joints = [joint for joint in root.iter("joint") if joint.get("type") in {"revolute", "continuous"}]
    for joint in joints:
        joint.set("type", "continuous")
        for part in [*joint.findall("limit"), *joint.findall("dynamics")]:
            joint.remove(part)
        ElementTree.SubElement(joint, "dynamics", {"damping": f"{damping}"})
    carried = {child.get("link") for joint in root.iter("joint") for child in joint.findall("child")}
    base = next(link for link in root.iter("link") if link.get("name") not in carried)
    origin = base.find("inertial/origin")
    centre = np.array([float(x) for x in (origin.get("xyz", "0 0 0") if origin is not None else "0 0 0").split()])
    path = folder / f"{name}.urdf"
    ElementTree.ElementTree(root).write(path)
    floats, _, (_, _, armature) = ROBOTS[name]
    names = [str(joint.get("name")) for joint in joints]
    return Body(path, floats, names, centre, armature * (controller != "efforts"))


class InMujoco:
    """A robot in MuJoCo, as its importer reads it."""

    def __init__(self, body: Body, scheme: str) -> None:
        mujoco = pytest.importorskip("mujoco")
        self.mujoco, self.floats = mujoco, body.floats
        spec = mujoco.MjSpec.from_file(str(body.path))
        spec.compiler.fusestatic = False
        if body.floats:
            spec.worldbody.first_body().add_freejoint()
        spec.option.timestep = STEP
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{scheme.split(maxsplit=1)[0]}")
        if scheme.endswith("explicit"):
            spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
        for joint in body.joints:
            spec.joint(joint).armature = body.armature
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.q = [int(self.model.joint(name).qposadr[0]) for name in body.joints]
        self.v = [int(self.model.joint(name).dofadr[0]) for name in body.joints]

    def start(self, q: np.ndarray, v: np.ndarray, base: np.ndarray) -> None:
        """Puts the robot into a state; ``base``: place, quaternion, velocity in the world, spin in the body."""
        self.data.qpos[self.q], self.data.qvel[self.v] = q, v
        if self.floats:
            self.data.qpos[:7], self.data.qvel[:6] = base[:7], base[7:]

    def state(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates and velocities of the joints, and the base."""
        base = np.concatenate([self.data.qpos[:7], self.data.qvel[:6]]) if self.floats else np.zeros(13)
        return self.data.qpos[self.q].copy(), self.data.qvel[self.v].copy(), base

    def step(self, efforts: np.ndarray) -> None:
        """Makes a step under efforts."""
        self.data.qfrc_applied[self.v] = efforts
        self.mujoco.mj_step(self.model, self.data)


class InPinocchio:
    """A robot in Pinocchio's terms, with steps of semi-implicit Euler, damping at the velocity before each."""

    def __init__(self, body: Body, damping: float) -> None:
        self.pin, self.floats, self.damping = pytest.importorskip("pinocchio"), body.floats, damping
        build = self.pin.buildModelFromUrdf
        self.model = build(str(body.path), self.pin.JointModelFreeFlyer()) if body.floats else build(str(body.path))
        self.data, self.joints = self.model.createData(), body.joints
        self.v_of = [self.model.joints[self.model.getJointId(name)].idx_v for name in body.joints]
        armature = np.zeros(self.model.nv)
        armature[self.v_of] = body.armature
        self.model.armature = armature
        self.all_q, self.all_v = self.pin.neutral(self.model), np.zeros(self.model.nv)

    def start(self, q: np.ndarray, v: np.ndarray, base: np.ndarray) -> None:
        """See :class:`InMujoco`."""
        offset = np.zeros(self.model.nv)
        offset[self.v_of], self.all_v[self.v_of] = q, v
        self.all_q = self.pin.integrate(self.model, self.pin.neutral(self.model), offset)
        if self.floats:
            R = Rotation.from_quat(base[3:7], scalar_first=True)
            self.all_q[:7] = [*base[:3], *base[4:7], base[3]]
            self.all_v[:6] = [*R.inv().apply(base[7:10]), *base[10:]]
        self.q = q.copy()

    def state(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See :class:`InMujoco`."""
        base = np.zeros(13)
        if self.floats:
            R = Rotation.from_quat(self.all_q[3:7])
            base = np.array(
                [*self.all_q[:3], self.all_q[6], *self.all_q[3:6], *R.apply(self.all_v[:3]), *self.all_v[3:6]]
            )
        return self.q.copy(), self.all_v[self.v_of].copy(), base

    def step(self, efforts: np.ndarray) -> None:
        """See :class:`InMujoco`."""
        force = np.zeros(self.model.nv)
        force[self.v_of] = efforts - self.damping * self.all_v[self.v_of]
        self.all_v = self.all_v + STEP * self.pin.aba(self.model, self.data, self.all_q, self.all_v, force)
        self.all_q = self.pin.integrate(self.model, self.all_q, STEP * self.all_v)
        self.q = self.q + STEP * self.all_v[self.v_of]


POLICY = """import numpy as np


def make(joints):
    weights = np.random.default_rng(4).normal(0, 0.4, (len(joints), 3 * len(joints)))
    return lambda seen: np.tanh(weights @ np.concatenate([seen.q, 0.1 * np.array(seen.v), seen.last]))
"""
SCALE = 0.3
TARGETS = 0.3 * np.sin(np.arange(12))


def policy_of(joints: int, q: np.ndarray, v: np.ndarray, last: np.ndarray) -> np.ndarray:
    """The policy of the file, written by hand."""
    weights = np.random.default_rng(4).normal(0, 0.4, (joints, 3 * joints))
    return np.asarray(np.tanh(weights @ np.concatenate([q, 0.1 * v, last])))


def loop(program: Any, body: Body, controller: str) -> dict[str, np.ndarray]:
    """Rows of a loop, one for each step: state, action, target and effort."""
    count = len(body.joints)
    _, sizes, (kp, kd, _) = ROBOTS[body.path.stem]
    generator = np.random.default_rng(8)
    q, v = generator.uniform(-0.3, 0.3, count), generator.uniform(-1, 1, count)
    turn = Rotation.from_rotvec([0.5, 0.3, -0.2]).as_quat(scalar_first=True)
    program.start(q, v, np.array([0.1, -0.2, 0.9, *turn, 0.4, -0.3, 0.2, 0.5, -0.8, 0.6]))
    rows: dict[str, list[np.ndarray]] = {name: [] for name in ("q", "v", "base", "action", "target", "effort")}
    action, target = np.zeros(count), TARGETS[:count] * (controller == "held targets")
    for k in range(STEPS + 1):
        q, v, base = program.state()
        if k % round(1 / RATE / STEP) == 0 and controller == "policy":
            action = policy_of(count, q, v, action)
            target = SCALE * action
        effort = kp * (target - q) - kd * v
        if controller == "efforts":
            effort = sizes * (np.sin(40 * STEP * k + np.arange(count)) - 0.3)
        for name, value in zip(rows, (q, v, base, action, target, effort), strict=True):
            rows[name].append(value.copy())
        program.step(effort)
    return {name: np.array(values) for name, values in rows.items()}


def arrays(rows: Mapping[str, np.ndarray], body: Body, layout: str, controller: str) -> dict[str, np.ndarray]:
    """The rows as arrays of a program's layout."""
    q, v, base, effort = rows["q"], rows["v"], rows["base"], rows["effort"]
    R = Rotation.from_quat(base[:, 3:7], scalar_first=True) if body.floats else None
    names = {"playground": ("action", "ctrl")}.get(layout, ("actions", "joint_pos_target"))
    further = {names[0]: rows["action"]} if controller == "policy" else {}
    further |= {names[1]: rows["target"]} if controller != "efforts" else {}
    if layout == "playground":
        whole = {"qpos": np.hstack([base[:, :7], q]), "qvel": np.hstack([base[:, 7:], v])} if body.floats else {}
        return {"qpos": q, "qvel": v} | whole | {"torques": effort} | further
    content = {}
    if R is not None:
        spin = R.apply(base[:, 10:])
        velocity = base[:, 7:10] + np.cross(spin, R.apply(body.centre))
        turn = base[:, 3:7] if layout == "isaaclab" else base[:, [4, 5, 6, 3]]
        name = "root_state_w" if layout == "isaaclab" else "root_states"
        content[name] = np.hstack([base[:, :3], turn, velocity, spin])
    names = ("joint_pos", "joint_vel", "applied_torque") if layout == "isaaclab" else ("dof_pos", "dof_vel", "torques")
    content |= dict(zip(names, (q, v, effort), strict=True))
    content |= further
    if layout == "isaaclab" and body.floats:  # legs by legs in the file, joints by joints there
        by_depth = [3 * leg + part for part in range(3) for leg in range(4)]
        content = {key: item if item.shape[1] == 13 else item[:, by_depth] for key, item in content.items()}
    return content


def control_file(body: Body, controller: str, folder: Path) -> Path | None:
    """File of the controller; None: the record has efforts alone."""
    if controller == "efforts":
        return None
    (folder / "loop_policy.py").write_text(POLICY)
    _, _, gains = ROBOTS[body.path.stem]
    policy = f'[policy]\ncall = "loop_policy:make"\nscale = {SCALE}\n' if controller == "policy" else ""
    path = folder / "control.toml"
    targets = "".join(f'"{joint}" = {value!r}\n' for joint, value in zip(body.joints, TARGETS.tolist(), strict=False))
    policy = policy or f"[targets]\n{targets}"
    numbers = "".join(f"{key} = {value}\n" for key, value in zip(("kp", "kd", "armature"), gains, strict=True))
    path.write_text(f'rate = {RATE}\n[[gains]]\njoints = "*"\n{numbers}{policy}')
    return path


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(
            case, id="-".join(map(str, case)), marks=pytest.mark.drill if case in QUICK else pytest.mark.nightly
        )
        for case in CHOSEN
    ],
)
def test_a_clean_loop_is_not_accused(case: tuple[str, float, str, str, str, str], tmp_path: Path) -> None:
    """A loop without a mistake holds in every layer, whatever its program, scheme, damping, digits and layout."""
    scheme, damping, precision, layout, controller, name = case
    body = bare(name, damping, controller, tmp_path)
    program, _, kind = scheme.partition(" ")
    made = InMujoco(body, kind) if program == "mujoco" else InPinocchio(body, damping)
    content = {
        key: values.astype(precision) if precision.startswith("float") else values.round(int(precision))
        for key, values in arrays(loop(made, body, controller), body, layout, controller).items()
    }
    np.savez(tmp_path / "run.npz", dt=STEP, **content)
    judged = judge_record(tmp_path / "run.npz", body.path, control_file(body, controller, tmp_path), layout=layout)
    said = "\n".join(judged.lines())
    assert judged.looked_at, said
    assert not [cause.id for layer in judged.layers for cause in layer.causes], said
    assert not [
        layer.name for layer in judged.layers if not (layer.holds or layer.undecided or layer.residual is None)
    ], said
