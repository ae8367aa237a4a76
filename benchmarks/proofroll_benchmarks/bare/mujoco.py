"""MuJoCo without the adapter: ``mj_step`` and the callbacks that the model needs.

The compiled model and the settled start come from the adapter's builder, which reads and writes the scene's MJCF file:
a user would write the same file and set the same depth once. Nothing of the adapter runs in the loops.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.rolling_and_spin import turning_frictions
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.engines.mujoco.contact.walls import curved_end
from proofroll.engines.mujoco.own_lines import stepped
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll_benchmarks.bare import Bare, in_vertical_cylinder

Mujoco = load_engine("mujoco")

_FATAL = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)


def prepare(scene: Scene, settings: Any) -> Bare:
    """See :mod:`proofroll_benchmarks.bare`."""
    if settings.formulation != "chart":
        lacks = _lacking(mechanism_of(scene), settings) if settings.formulation == "geoms" else ""
        return Bare(_mechanism(scene, settings), 1e-12, "the same steps; sums are in another order", lacks)
    body = in_vertical_cylinder(scene)
    model, data = Mujoco.build(scene, settings).native
    run = _chart(model, data, body, settings)
    return Bare(run, 1e-9, "the geometry is rounded otherwise, which a stiff contact magnifies")


def _lacking(mechanism: Mechanism, settings: Any) -> str:
    """Parts of the steps of bodies that touch which MuJoCo has not."""
    parts = {
        "wall": any(curved_end(contact) is not None for contact in mechanism.contacts),
        "rolling resistance": any(not friction.spins for friction in turning_frictions(mechanism.contacts)),
        "correction": settings.cone_correction or settings.curvature,
    }
    return " and ".join(name for name, present in parts.items() if present and mechanism.contacts)


def _counted(times: FloatArray, dt: float) -> list[int]:
    return [round(interval / dt) for interval in np.diff(times).tolist()]


def _check(data: Any) -> None:
    for kind in _FATAL:
        if data.warning[kind].number:
            raise Diverged("MuJoCo's state is not finite or huge")


class _Resistance:
    """Torque f N e1 × v/V with the normal force extrapolated from the last two evaluations at other times."""

    def __init__(self, f: float, torque: FloatArray) -> None:
        self.f, self.torque = f, torque
        self.last, self.before, self.N_before, self.slope = 0.0, 0.0, 0.0, 0.0

    def start(self, memory: Any) -> None:
        """Takes the values that the evaluations at time 0 left."""
        self.last, self.before, self.N_before, self.slope = memory[:4].tolist()

    def apply(self, t: float, N: float, e1: tuple[float, float], v: list[float]) -> None:
        """Sets the torque for the time t [s] from the normal force of the evaluation before [N]."""
        if self.last > self.before:
            self.slope = (N - self.N_before) / (self.last - self.before)
        ahead = N + self.slope * (t - self.last)
        self.before, self.N_before, self.last = self.last, N, t
        e1x, e1y = e1
        vx, vy, vz = v
        scale = -self.f * max(ahead, 0.0) / (math.sqrt(vx * vx + vy * vy + vz * vz) or 1.0)
        self.torque[0], self.torque[1], self.torque[2] = (
            -scale * vz * e1y,
            scale * vz * e1x,
            scale * (vx * e1y - vy * e1x),
        )


def _chart(model: Any, data: Any, body: RollingBall, settings: Any) -> Callable[[FloatArray], FloatArray]:
    ball, wall, touch = model.body("ball").id, model.geom("wall").id, model.site("touch").id
    depth = int(model.joint("normal").dofadr[0])
    # Views of MjData's memory, taken once.
    wall_p, wall_R = data.geom_xpos[wall], data.geom_xmat[wall]
    touch_p, touch_R = data.site_xpos[touch], data.site_xmat[touch]
    reaction, velocity = data.qfrc_constraint, data.cvel[ball, 3:]

    def follow(model: Any, data: Any, geom1: int, geom2: int) -> int:  # noqa: ARG001 -- MuJoCo's signature
        wall_p[:] = touch_p
        wall_R[:] = touch_R
        return 0

    f = body.contact.rolling_resistance
    resistance = _Resistance(f, data.xfrc_applied[ball, 3:])

    def resist(model: Any, data: Any) -> None:  # noqa: ARG001 -- MuJoCo's signature
        e1 = -float(touch_R[2]), -float(touch_R[5])
        resistance.apply(data.time, -float(reaction[depth]), e1, velocity.tolist())

    def run(times: FloatArray) -> FloatArray:
        if f:
            resistance.start(data.userdata)
        mujoco.set_mjcb_contactfilter(follow)
        mujoco.set_mjcb_passive(resist if f else None)
        try:
            for steps in _counted(times, settings.dt):
                mujoco.mj_step(model, data, nstep=steps)
                _check(data)
        finally:
            mujoco.set_mjcb_contactfilter(None)
            mujoco.set_mjcb_passive(None)
        mujoco.mj_kinematics(model, data)
        return np.array(data.xpos[ball])

    return run


def _mechanism(scene: Scene, settings: Any) -> Callable[[FloatArray], FloatArray]:
    """``mj_step`` from sample to sample, without the sensors that only a sample asks for."""
    model, data = Mujoco.build(scene, settings).native
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    bodies = [model.body(body.name).id for body in mechanism_of(scene).bodies]

    def run(times: FloatArray) -> FloatArray:
        for _ in stepped(model, data, times.tolist()):
            pass
        mujoco.mj_forward(model, data)
        return np.array(data.xpos[bodies])

    return run
