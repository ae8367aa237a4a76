"""Writes the program that shows what MuJoCo does with a ball on a wall, without proofroll."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import assigned, ball_numbers, normal_rate_source, wall_source
from proofroll.engines.mujoco.contact import Resistance
from proofroll.engines.mujoco.friction import NEAR_CONE, corrects
from proofroll.engines.mujoco.reproducer import text
from proofroll.engines.mujoco.settings import PRELOAD, MujocoSettings, normal_lead, own_share, velocity_lag
from proofroll.engines.mujoco.start import EVALUATIONS


def source(xml: str, model: Any, data: Any, body: RollingBall, settings: MujocoSettings) -> str:
    """See :class:`proofroll.core.engine_abilities.Reproduces`.

    Args:
        xml: the model as MuJoCo writes it.
        model: compiled.
        data: at time 0.
        body: the scene's.
        settings: of the adapter.

    Raises:
        Refused: the scene or the settings have something that the program has not.
    """
    contact, lags = body.contact, velocity_lag(settings)
    if math.isfinite(contact.mu_static) and contact.mu_static != contact.mu_kinetic:
        raise Refused("the program has one coefficient of friction, as MuJoCo has")
    edits = corrects(contact, settings)
    if edits and settings.cone != "elliptic":
        raise Refused("the program corrects the elliptic cone alone")
    resists = contact.rolling_resistance > 0
    values: dict[str, Any] = {}
    if resists:
        law = Resistance.of(body, settings.dt)
        values = {"LEVER": law.f, "STOPPING": law.stopping, "PULL": np.array(law.pull)}
    steps = {
        "free": text.free(resists=resists, curvature=settings.curvature, corrects=edits),
        "chart": text.chart(resists=resists, corrects=edits),
        "facets": text.facets(resists=resists),
    }[settings.formulation]
    if settings.formulation == "free" and (settings.curvature or edits):
        values["LAG"] = lags
    if settings.curvature:
        values |= {"SHARE": 1 - own_share(settings), "LEAD": normal_lead(settings)}
    if edits:
        values |= {"FRICTION": contact.mu_kinetic, "PRELOAD": PRELOAD / body.ball.mass, "NEAR_CONE": NEAR_CONE}
    xml = textwrap.dedent(xml).strip()
    exact = _rounded(xml, model)
    state = ("qpos", "qvel", "qacc", "qacc_warmstart", "qfrc_constraint", "geom_xmat", "userdata")
    return "".join(
        [
            "import mujoco\nimport numpy as np\n\n",
            assigned(**ball_numbers(body), **values),
            f"EVALUATIONS = {EVALUATIONS if resists else 1}\n" if lags else "",
            wall_source(body),
            normal_rate_source(body) if settings.curvature else "",
            f'\n\nMODEL = """\n{xml}\n"""\nmodel = mujoco.MjModel.from_xml_string(MODEL)\n',
            "# The file rounds to six digits; these are all of them.\n",
            *(f"model.{name}[:] = {value.tolist()!r}\n" for name, value in exact.items()),
            f"model.opt.timestep = {settings.dt!r}\nBALL = model.body('ball').id\n",
            f"WALL = {_wall(model, settings)}\n",
            f"DEPTH = {int(model.joint('normal').dofadr[0])}\n" if settings.formulation == "chart" else "",
            "data = mujoco.MjData(model)\n",
            *(f"data.{name}[:] = {getattr(data, name).tolist()!r}\n" for name in state),
            text.RESIST if resists else "",
            text.CURVATURE if settings.curvature else "",
            text.CORRECT if edits else "",
            steps,
            text.run(lags=bool(lags)),
        ]
    )


def _wall(model: Any, settings: MujocoSettings) -> int:
    """Number of the wall's geom, or of the first of its boxes."""
    return int(model.body("wall").geomadr[0] if settings.formulation == "facets" else model.geom("wall").id)


def _rounded(xml: str, model: Any) -> dict[str, FloatArray]:
    """What of the model its file, with six digits, does not give back: numbers, and shortcuts that hang on them."""
    read = mujoco.MjModel.from_xml_string(xml)
    found = {}
    for name in dir(model):
        value = getattr(model, name) if not name.startswith("_") else None
        if (
            isinstance(value, np.ndarray)
            and value.dtype.kind in "fiu"
            and not np.array_equal(value, getattr(read, name))
        ):
            found[name] = value.copy()
    return found
