"""A program that runs a mechanism in MuJoCo alone."""

from __future__ import annotations

from proofroll.elements.mechanism import Mechanism

_SOURCE = '''import mujoco
import numpy as np

MODEL = """{model}"""
# Places that are followed: body, and where on it [m].
PLACES = {places!r}


def run(times):
    """Places [m], energy [J] and how far loops are open [m] at each time."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data, now = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    bodies, at = [model.body(name).id for name, _ in PLACES], np.array([place for _, place in PLACES])
    before = 0.0
    for t in times:
        steps = round((t - before) / model.opt.timestep)
        if steps:
            mujoco.mj_step(model, data, steps)
        before = t
        if data.warning.number.any():
            raise RuntimeError(f"MuJoCo warns before {{t:g}} s that the state is not finite or huge")
        mujoco.mj_copyData(now, model, data)
        mujoco.mj_forward(model, now)
        places = now.xpos[bodies] + np.einsum("nij,nj->ni", now.xmat[bodies].reshape(-1, 3, 3), at)
        yield places, float(now.energy.sum()), float(np.abs(now.efc_pos[: now.ne]).max(initial=0.0))
'''


def source(xml: str, mechanism: Mechanism) -> str:
    """The program's part that runs a mechanism, given as MJCF whose first keyframe is the start."""
    places = [(point.body, [float(x) for x in point.position]) for point in mechanism.points]
    places = places or [(body.name, [0.0, 0.0, 0.0]) for body in mechanism.bodies]
    return _SOURCE.format(model=xml, places=places)
