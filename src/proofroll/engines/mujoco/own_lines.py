"""Settings as lines of a user's own MJCF."""

import inspect
from collections.abc import Iterable, Iterator, Sequence
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np

from proofroll.core.errors import Refused
from proofroll.core.program_text import assignment
from proofroll.elements.mechanism import Mechanism
from proofroll.engines.mujoco.settings import PRESETS, MujocoSettings
from proofroll.engines.mujoco.smooth.mechanism_model import set_integration

_HEAD = "from __future__ import annotations\nimport mujoco\nimport numpy as np\n\n\n"
_RUN = '''

def run(times):
    """Places [m], energy [J] and how far loops are open [m] at each time."""
    yield from followed(MODEL, PLACES, times)
'''


def mechanism_source(xml: str, mechanism: Mechanism) -> str:
    """Part of the program that runs a mechanism, given as MJCF whose first keyframe is the start."""
    places = [(body, [float(x) for x in position]) for body, position in mechanism.followed]
    asks = "# Places that are followed: body, and where on it [m].\n" + assignment(PLACES=places)
    steps = "\n\n".join(map(inspect.getsource, (stepped, followed)))
    return f'{_HEAD}{steps}\n\nMODEL = """{xml}"""\n{asks}{_RUN}'


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


def own_lines(settings: MujocoSettings) -> list[str]:
    """See :class:`proofroll.core.engine_abilities.TellsLines`: ``<option>`` and ``<default>``, with comments.

    Raises:
        Refused: an added formulation, as no model of MuJoCo's alone.
    """
    if settings.formulation not in PRESETS:
        raise Refused(f"{settings.formulation} is a model of proofroll's; proofroll export writes it")
    spec = mujoco.MjSpec()
    set_integration(spec.option, settings)
    settings.soften(spec.default.equality)
    settings.set_solver(spec.option, contacts=settings.formulation == "geoms")
    if settings.formulation == "geoms":
        settings.soften(spec.default.geom)
    spec.compile()
    lines: list[str] = []
    for section in ElementTree.fromstring(spec.to_xml()):
        if section.tag == "option":
            section.set("timestep", repr(settings.dt))  # MjSpec writes six digits
        if section.tag in {"option", "default"}:
            ElementTree.indent(section)
            lines += ElementTree.tostring(section, encoding="unicode").strip().splitlines()
    if settings.formulation == "geoms":
        lines.append(
            '<!-- a pair with restitution e: solref="-1 -(1 + e)/timestep" solreffriction="-1e-9 -1/timestep" -->'
        )
    edits = ["cone_correction", "curvature"] if settings.formulation == "geoms" else []
    edited = [name for name in edits if getattr(settings, name)]
    if edited:
        lines.append(f"<!-- {' and '.join(edited)}: mjData.efc_aref, edited between mj_step1 and mj_step2 -->")
    if settings.damping_armature:
        armature = "each joint's armature has timestep × (damping + timestep × stiffness of its servo) more"
        lines.append(f"<!-- damping_armature: {armature} -->")
    return lines or ["<!-- MuJoCo's defaults -->"]
