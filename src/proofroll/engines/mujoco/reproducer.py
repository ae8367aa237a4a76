"""Writes the program that shows what MuJoCo does with a ball on a wall, without proofroll."""

from __future__ import annotations

import textwrap
from typing import Any

import mujoco
import numpy as np

from proofroll.engines.mujoco.friction import corrects
from proofroll.engines.mujoco.settings import MujocoSettings
from proofroll.errors import Refused
from proofroll.reproducing import assigned, ball_numbers, refuse_terms, wall_source
from proofroll.scene import RollingBall
from proofroll.surfaces import FloatArray

_STEP = {
    "free": '''

def step():
    """One step, after the plane was put where the ball touches the wall: MuJoCo has no concave cylinder."""
    p = data.qpos[:3]
    e1 = frame(p)[0]
    data.mocap_pos[0] = p + (RADIUS + gap(p)) * e1
    mujoco.mju_quatZ2Vec(data.mocap_quat[0], -e1)
    mujoco.mj_step(model, data)
''',
    "facets": '''

def step():
    """One step."""
    mujoco.mj_step(model, data)
    if abs(frame(np.array(POSITION))[2] @ data.qpos[:3]) > model.geom_size[model.body("wall").geomadr[0], 2]:
        raise RuntimeError("the ball has left the ring of boxes")
''',
    "chart": '''

def pose_wall(m, d, geom1, geom2):
    """Called between kinematics and collision at each evaluation: the plane takes the pose of the site."""
    wall, touch = m.geom("wall").id, m.site("touch").id
    d.geom_xpos[wall], d.geom_xmat[wall] = d.site_xpos[touch], d.site_xmat[touch]
    return 0


mujoco.set_mjcb_contactfilter(pose_wall)


def step():
    """One step."""
    mujoco.mj_step(model, data)
''',
}

_RUN = '''

FATAL = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC", "mjWARN_CONTACTFULL", "mjWARN_CNSTRFULL")


def run(times):
    """Centre, velocity and angular velocity of the ball in the world at each time."""
    look, ball, velocity, done = mujoco.MjData(model), model.body("ball").id, np.zeros(6), 0
    for t in times:
        while done < round(t / model.opt.timestep):
            step()
            done += 1
        for name in FATAL:
            if data.warning[getattr(mujoco.mjtWarning, name)].number:
                raise RuntimeError(f"MuJoCo warns of {name} before {t:g} s")
        mujoco.mj_copyData(look, model, data)
        mujoco.mj_kinematics(model, look)
        mujoco.mj_comPos(model, look)
        mujoco.mj_comVel(model, look)
        mujoco.mj_objectVelocity(model, look, mujoco.mjtObj.mjOBJ_BODY, ball, velocity, 0)
        yield look.xpos[ball].copy(), velocity[3:].copy(), velocity[:3].copy()
'''


def source(xml: str, model: Any, data: Any, body: RollingBall, settings: MujocoSettings) -> str:
    """See :class:`proofroll.engine.Reproduces`.

    Args:
        xml: the model as MuJoCo writes it.
        model: compiled.
        data: at time 0.
        body: the scene's.
        settings: of the adapter.

    Raises:
        Refused: the settings edit what MuJoCo computes, or the scene has a term that the program has not.
    """
    refuse_terms(body, friction=True)
    if settings.curvature or corrects(body.contact, settings):
        raise Refused("these settings edit mjData.efc_aref, which is no documented use of MuJoCo")
    xml = textwrap.dedent(xml).strip()
    exact = _rounded(xml, model)
    return (
        "import mujoco\nimport numpy as np\n\n"
        + assigned(**ball_numbers(body))
        + wall_source(body)
        + f'\n\nMODEL = """\n{xml}\n"""\n'
        + "model = mujoco.MjModel.from_xml_string(MODEL)\n"
        + "# The file rounds to six digits; these are all of them.\n"
        + "".join(f"model.{name}[:] = {value.tolist()!r}\n" for name, value in exact.items())
        + f"model.opt.timestep = {settings.dt!r}\n"
        + "data = mujoco.MjData(model)\n"
        + f"data.qpos[:] = {data.qpos.tolist()!r}\ndata.qvel[:] = {data.qvel.tolist()!r}\n"
        + f"data.qacc_warmstart[:] = {data.qacc_warmstart.tolist()!r}\n"
        + _STEP[settings.formulation]
        + _RUN
    )


def _rounded(xml: str, model: Any) -> dict[str, FloatArray]:
    """The numbers of the model that its file has with six digits only."""
    read = mujoco.MjModel.from_xml_string(xml)
    found = {}
    for name in dir(model):
        value = getattr(model, name) if not name.startswith("_") else None
        if (
            isinstance(value, np.ndarray)
            and value.dtype == np.float64
            and not np.array_equal(value, getattr(read, name))
        ):
            found[name] = value.copy()
    return found
