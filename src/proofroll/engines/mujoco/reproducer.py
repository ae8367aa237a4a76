"""Source of a program that repeats a run with MuJoCo alone, without proofroll: of a ball on a wall or a mechanism."""

import math
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.cut_out import CutOut
from proofroll.core.errors import Refused
from proofroll.core.program_text import assignment
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import cut_program
from proofroll.elements.mechanism import Mechanism
from proofroll.engines.mujoco.ball.chart import Chart
from proofroll.engines.mujoco.ball.free import Facets, Free
from proofroll.engines.mujoco.ball.friction import BoundedFriction
from proofroll.engines.mujoco.ball.start import EVALUATIONS
from proofroll.engines.mujoco.running import raise_if_fatal
from proofroll.engines.mujoco.settings import MujocoSettings

_RUN = '''

def run(times):
    """Centre, velocity and angular velocity of the ball in the world at each time."""
    look, velocity, done, ball = mujoco.MjData(model), np.zeros(6), 0, model.body("ball").id
    for t in times:
        steps = round(t / SETTINGS.dt) - done
        if steps:
            formulation.run(data, steps)
            done += steps
        raise_if_fatal(data, t)
        mujoco.mj_copyData(look, model, data)
        if SETTINGS.velocity_lag:
            for _ in range(EVALUATIONS):
                formulation.evaluate(look)
            look.qvel += SETTINGS.velocity_lag * look.qacc  # velocities are behind the positions
        mujoco.mj_kinematics(model, look)
        mujoco.mj_comPos(model, look)
        mujoco.mj_comVel(model, look)
        mujoco.mj_objectVelocity(model, look, mujoco.mjtObj.mjOBJ_BODY, ball, velocity, 0)
        yield look.xpos[ball].copy(), velocity[3:].copy(), velocity[:3].copy()
'''
_MECHANISM = '''

def run(times):
    """Places [m], energy [J] and how far loops are open [m] at each time."""
    yield from followed(MODEL, PLACES, times)
'''


def source(xml: str, model: Any, data: Any, body: RollingBall, settings: MujocoSettings) -> str:
    """Source of a program for a ball: loads the model saved by MuJoCo and its state at time 0, and steps.

    See ``Reproduces`` in ``core.engine_abilities``.

    Raises:
        Refused: static and kinetic coefficients of friction differ.
    """
    contact, formulation = body.contact, {"free": Free, "chart": Chart, "facets": Facets}[settings.formulation]
    bounded = math.isfinite(contact.mu_static)
    if bounded and contact.mu_static != contact.mu_kinetic:
        raise Refused("the program has one coefficient of friction, as MuJoCo has")
    xml = textwrap.dedent(xml).strip()
    state = ("qpos", "qvel", "qacc", "qacc_warmstart", "qfrc_constraint", "geom_xmat", "userdata")
    read = [
        f'\n\nMODEL = """\n{xml}\n"""\nmodel = mujoco.MjModel.from_xml_string(MODEL)\n',
        "# The file rounds to six digits; these are all of them.\n",
        *(f"model.{name}[:] = {value.tolist()!r}\n" for name, value in _rounded(xml, model).items()),
        f"model.opt.timestep = {settings.dt!r}\ndata = mujoco.MjData(model)\n",
        *(f"data.{name}[:] = {getattr(data, name).tolist()!r}\n" for name in state),
        f"friction = {'BoundedFriction(model, BODY, SETTINGS)' if bounded else None}\n",
        f"formulation = {formulation.__name__}(model, BODY, SETTINGS, friction)\n",
    ]
    objects = [formulation, raise_if_fatal, *([BoundedFriction] if bounded else [])]
    evaluations = EVALUATIONS if contact.rolling_resistance else 1
    uses = ("run", "evaluate", "velocity_lag", "dt")
    return cut_program(body, settings, objects, uses, "".join([*read, _RUN]), EVALUATIONS=evaluations)


def mechanism_source(xml: str, mechanism: Mechanism) -> str:
    """Part of the program that runs a mechanism, given as MJCF whose first keyframe is the start."""
    places = [(body, [float(x) for x in position]) for body, position in mechanism.followed]
    asks = "# Places that are followed: body, and where on it [m].\n" + assignment(PLACES=places)
    cut = CutOut([followed], [])
    return f'{cut.head}\n{cut.text}\n\nMODEL = """{xml}"""\n{asks}{_MECHANISM}'


def _rounded(xml: str, model: Any) -> dict[str, FloatArray]:
    """Fields of MjModel, by name, whose numbers (given or derived) are rounded or lost in a file with six digits."""
    read = mujoco.MjModel.from_xml_string(xml)
    changed = {}
    for name in dir(model):
        value = getattr(model, name) if not name.startswith("_") else None
        if (
            isinstance(value, np.ndarray)
            and value.dtype.kind in "fiu"
            and not np.array_equal(value, getattr(read, name))
        ):
            changed[name] = value.copy()
    return changed


def stepped(model: Any, data: Any, times: Iterable[float]) -> Iterator[float]:
    """Steps the state from time 0 to each time [s], which it then yields.

    Raises:
        RuntimeError: MuJoCo warns.
    """
    last = 0.0
    for t in times:
        steps = round((t - last) / model.opt.timestep)
        if steps:
            mujoco.mj_step(model, data, steps)
        last = t
        if data.warning.number.any():
            raise RuntimeError(f"MuJoCo warns before {t:g} s that the state is not finite or huge")
        yield t


def followed(
    xml: str, places: Sequence[tuple[str, Sequence[float]]], times: Iterable[float]
) -> Iterator[tuple[Any, float, float]]:
    """Places on bodies [m], energy [J] and how far loops are open [m] at each time [s]."""
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data, now = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    bodies, places_on_bodies = [model.body(name).id for name, _ in places], np.array([place for _, place in places])
    for _ in stepped(model, data, times):
        mujoco.mj_copyData(now, model, data)
        mujoco.mj_forward(model, now)
        seen = now.xpos[bodies] + np.einsum("nij,nj->ni", now.xmat[bodies].reshape(-1, 3, 3), places_on_bodies)
        yield seen, float(now.energy.sum()), float(np.abs(now.efc_pos[: now.ne]).max(initial=0.0))
