"""A scene at its start in MuJoCo, from which worlds of MuJoCo Warp are made."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import mujoco_warp
import numpy as np
import warp

from proofroll.adapter import Scene
from proofroll.engines.mujoco import mjspec
from proofroll_mujoco_warp.settings import INTEGRATORS, MujocoWarpSettings


def start_of(scene: Scene, settings: MujocoWarpSettings) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Model and data of MuJoCo at time 0."""
    integrator = INTEGRATORS[settings.formulation]
    host = mjspec(scene, portable=True, sensors=False, dt=settings.dt, integrator=integrator).compile()
    start = mujoco.MjData(host)
    mujoco.mj_resetDataKeyframe(host, start, host.key("start").id)
    mujoco.mj_forward(host, start)
    return host, start


def rows_of(host: mujoco.MjModel) -> int:
    """Most rows of constraints that a world can have, without contacts: more room for them slows every step."""
    equalities, limits = 6 * host.neq, 2 * (host.njnt + host.ntendon)
    return int(equalities + host.nv + limits)


class SeenData:
    """Places and velocities of all bodies in worlds, computed apart from the data that step.

    The velocities that MuJoCo Warp keeps from its last step give the connects of the next one: to compute them anew
    would move the run.

    Args:
        model: of the worlds.
        data: scratch of the same sizes as the data that step.
    """

    def __init__(self, model: Any, data: Any) -> None:
        self._model, self._data = model, data

    def of(self, data: Any) -> Callable[[str], np.ndarray[Any, Any]]:
        """Function from the name of an array, as MuJoCo's, to its values in the state of the data that step."""
        for name in ("qpos", "qvel"):
            warp.copy(getattr(self._data, name), getattr(data, name))
        for refresh in (mujoco_warp.kinematics, mujoco_warp.com_pos, mujoco_warp.com_vel):
            refresh(self._model, self._data)
        return lambda name: np.asarray(getattr(self._data, name).numpy())
