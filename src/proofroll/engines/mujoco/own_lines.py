"""Settings as lines of a user's own MJCF."""

from xml.etree import ElementTree

import mujoco

from proofroll.core.errors import Refused
from proofroll.engines.mujoco.settings import PRESETS, MujocoSettings
from proofroll.engines.mujoco.smooth.mechanism_model import set_integration


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
    if settings.formulation == "geoms":
        spec.option.cone = getattr(mujoco.mjtCone, f"mjCONE_{settings.cone.upper()}")
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
