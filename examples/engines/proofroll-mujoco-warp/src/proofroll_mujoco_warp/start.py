"""A scene at its start in MuJoCo, from which worlds of MuJoCo Warp are made."""

from __future__ import annotations

import mujoco

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
