"""Stand-in for the part of Isaac Lab 2.x that a probe uses: MuJoCo moves the robot; arrays are those of Isaac Lab."""

from __future__ import annotations

import re
from types import ModuleType, SimpleNamespace
from typing import Any

import mujoco
import numpy as np


class Articulation:
    """Robot whose joints are in the order of their distance from the root, and whose velocity is that of its centre."""

    device = "cpu"

    def __init__(self, cfg: Any) -> None:
        spec = mujoco.MjSpec.from_file(cfg.spawn.asset_path)
        self.free = not cfg.spawn.fix_base
        if self.free:
            spec.worldbody.first_body().add_freejoint()
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_CONTACT
        self.model = spec.compile()
        single = [k for k in range(self.model.njnt) if self.model.joint(k).type[0] != mujoco.mjtJoint.mjJNT_FREE]
        self.joint_names = [self.model.joint(k).name for k in sorted(single, key=self._level)]
        drives = cfg.actuators["all"].damping
        self._damping = np.array(
            [next(value for key, value in drives.items() if re.fullmatch(key, name)) for name in self.joint_names]
        )
        self.simulated = mujoco.MjData(self.model)
        self.places = [self.model.joint(name).qposadr[0] for name in self.joint_names]
        self.rates = [self.model.joint(name).dofadr[0] for name in self.joint_names]
        self._applied = np.zeros(len(self.joint_names))
        for dof, damping in zip(self.rates, self._damping, strict=True):
            self.model.dof_damping[dof] = damping  # drives of PhysX are implicit, as is MuJoCo's damping
        SimulationContext.robot = self

    def _level(self, joint: int) -> int:
        body, level = self.model.jnt_bodyid[joint], 0
        while body:
            body, level = self.model.body_parentid[body], level + 1
        return level

    def write_joint_state_to_sim(self, position: np.ndarray, velocity: np.ndarray) -> None:
        """Sets coordinates and rates of the joints."""
        self.simulated.qpos[self.places], self.simulated.qvel[self.rates] = position[0], velocity[0]

    def write_root_state_to_sim(self, state: np.ndarray) -> None:
        """Sets place, quaternion and velocities of the base."""
        self.simulated.qpos[:7], self.simulated.qvel[:6] = state[0, :7], state[0, 7:]

    def set_joint_effort_target(self, target: np.ndarray) -> None:
        """Keeps efforts for the next step."""
        self._target = target[0]

    def write_data_to_sim(self) -> None:
        """Applies efforts; the damping of drives counts as applied."""
        self.simulated.qfrc_applied[self.rates] = self._target
        self._applied = self._target - self._damping * self.simulated.qvel[self.rates]

    def update(self, dt: float) -> None:
        """Reads the state back, which is done on demand here."""

    @property
    def data(self) -> SimpleNamespace:
        """Arrays of one environment in single precision."""
        q, v = self.simulated.qpos, self.simulated.qvel
        arrays = {"joint_pos": q[self.places], "joint_vel": v[self.rates], "applied_torque": self._applied}
        if self.free:
            R = np.zeros(9)
            mujoco.mju_quat2Mat(R, q[3:7])
            spin, centre = R.reshape(3, 3) @ v[3:6], R.reshape(3, 3) @ self.model.body_ipos[1]
            arrays["root_state_w"] = np.concatenate([q[:7], v[:3] + np.cross(spin, centre), spin])
        return SimpleNamespace(**{name: np.float32(values)[None] for name, values in arrays.items()})


class SimulationContext:
    """The simulation, of the last robot."""

    robot: Articulation

    def __init__(self, cfg: Any) -> None:
        self.dt = cfg.dt

    def reset(self) -> None:
        """Begins."""

    def step(self, *, render: bool) -> None:
        """Makes one step without drawing it."""
        assert not render
        self.robot.model.opt.timestep = self.dt
        mujoco.mj_step(self.robot.model, self.robot.simulated)


def modules() -> dict[str, ModuleType]:
    """Modules that the script imports, by name."""

    def module(name: str, **content: Any) -> ModuleType:
        made = ModuleType(name)
        vars(made).update(content)
        return made

    drive = type("JointDriveCfg", (SimpleNamespace,), {"PDGainsCfg": SimpleNamespace})
    sim = {"UrdfConverterCfg": SimpleNamespace(JointDriveCfg=drive), "SimulationContext": SimulationContext}
    sim |= dict.fromkeys(("SimulationCfg", "UrdfFileCfg", "RigidBodyPropertiesCfg"), SimpleNamespace)
    app = SimpleNamespace(app=SimpleNamespace(close=lambda: None))
    made = {
        "isaaclab": module("isaaclab", __path__=[]),
        "isaaclab.app": module("isaaclab.app", AppLauncher=lambda *, headless: app if headless else None),
        "isaaclab.sim": module("isaaclab.sim", **sim),
        "isaaclab.actuators": module("isaaclab.actuators", ImplicitActuatorCfg=SimpleNamespace),
        "isaaclab.assets": module("isaaclab.assets", Articulation=Articulation, ArticulationCfg=SimpleNamespace),
        "torch": module("torch", tensor=lambda values, *, device: np.array(values) if device else None),
    }
    made["isaaclab"].sim = made["isaaclab.sim"]  # type: ignore[attr-defined]
    return made
