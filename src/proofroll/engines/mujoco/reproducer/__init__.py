"""Writes the program that shows what MuJoCo does without proofroll: with a ball on a wall, or with a mechanism."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.core.program_text import assigned, module_text
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import ball_numbers, normal_rate_source, wall_source
from proofroll.elements.mechanism import Mechanism
from proofroll.engines.mujoco.contact import Resistance
from proofroll.engines.mujoco.friction import NEAR_CONE, corrects
from proofroll.engines.mujoco.reproducer import mechanism_loop, text
from proofroll.engines.mujoco.settings import PRELOAD, MujocoSettings
from proofroll.engines.mujoco.start import EVALUATIONS

_MECHANISM = '''

def run(times):
    """Places [m], energy [J] and how far loops are open [m] at each time."""
    yield from followed(MODEL, PLACES, times)
'''


def source(xml: str, model: Any, data: Any, body: RollingBall, settings: MujocoSettings) -> str:
    """See :class:`proofroll.core.engine_abilities.Reproduces`; from the model as MuJoCo writes it, and at time 0.

    Raises:
        Refused: the scene or the settings have something that the program has not.
    """
    contact, formulation = body.contact, settings.formulation
    if math.isfinite(contact.mu_static) and contact.mu_static != contact.mu_kinetic:
        raise Refused("the program has one coefficient of friction, as MuJoCo has")
    corrected = corrects(contact, settings)
    if corrected and settings.cone != "elliptic":
        raise Refused("the program corrects the elliptic cone alone")
    resists, edited = contact.rolling_resistance > 0, settings.curvature or corrected
    values: dict[str, Any] = {"LEVER": contact.rolling_resistance, "LAG": settings.velocity_lag}
    if resists:
        law = Resistance.of(body, settings.dt)
        values |= {"STOPPING": law.stopping, "PULL": law.pull}
    if settings.velocity_lag:
        values["EVALUATIONS"] = EVALUATIONS if resists else 1
    if settings.curvature:
        values |= {"SHARE": 1 - settings.own_share, "LEAD": settings.normal_lead}
    if corrected:
        values |= {"FRICTION": contact.mu_kinetic, "PRELOAD": PRELOAD / body.ball.mass, "NEAR_CONE": NEAR_CONE}
    if formulation == "free" and edited:
        values |= {"CURVED": settings.curvature, "CORRECTED": corrected}
    if formulation == "chart":
        values["DEPTH"] = int(model.joint("normal").dofadr[0])
    # The wall's geom, or the first of its boxes.
    values["WALL"] = int(model.body("wall").geomadr[0] if formulation == "facets" else model.geom("wall").id)
    xml = textwrap.dedent(xml).strip()
    state = ("qpos", "qvel", "qacc", "qacc_warmstart", "qfrc_constraint", "geom_xmat", "userdata")
    steps = {
        "free": [text.FREE_POSE, text.FREE_EDITED if edited else text.FREE_PLAIN],
        "chart": [text.CHART, text.CHART_RESIST if resists else "", text.CHART_CORRECT if corrected else ""],
        "facets": [text.FACETS],
    }
    return "".join(
        [
            "import mujoco\nimport numpy as np\n\n",
            assigned(**ball_numbers(body), **values),
            wall_source(body),
            normal_rate_source(body) if settings.curvature else "",
            f'\n\nMODEL = """\n{xml}\n"""\nmodel = mujoco.MjModel.from_xml_string(MODEL)\n',
            "# The file rounds to six digits; these are all of them.\n",
            *(f"model.{name}[:] = {value.tolist()!r}\n" for name, value in _rounded(xml, model).items()),
            f"model.opt.timestep = {settings.dt!r}\nBALL = model.body('ball').id\n",
            "data = mujoco.MjData(model)\n",
            *(f"data.{name}[:] = {getattr(data, name).tolist()!r}\n" for name in state),
            text.RESIST if resists else "",
            text.CURVATURE if settings.curvature else "",
            text.CORRECT if corrected else "",
            *steps[formulation],
            text.RUN,
        ]
    )


def mechanism_source(xml: str, mechanism: Mechanism) -> str:
    """The program's part that runs a mechanism, given as MJCF whose first keyframe is the start."""
    places = [(point.body, [float(x) for x in point.position]) for point in mechanism.points]
    places = places or [(body.name, [0.0, 0.0, 0.0]) for body in mechanism.bodies]
    asks = "# Places that are followed: body, and where on it [m].\n" + assigned(PLACES=places)
    return f'{module_text(mechanism_loop)}\n\nMODEL = """{xml}"""\n{asks}{_MECHANISM}'


def _rounded(xml: str, model: Any) -> dict[str, FloatArray]:
    """Numbers of the model, and shortcuts from them, that its file with six digits does not give back."""
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
