"""Settings as lines of a user's own Exudyn program."""

from collections.abc import Iterator, Mapping
from typing import Any

from proofroll.engines.exudyn.integration import simulation_settings
from proofroll.engines.exudyn.native import exu
from proofroll.engines.exudyn.settings import EXPLICIT, ExudynSettings

# Settings that say what a run writes and how long it is.
_OF_A_RUN = (
    "solution",
    "parallel",
    "timeIntegration.endTime",
    "timeIntegration.numberOfSteps",
    "timeIntegration.verbose",
)


def own_lines(settings: ExudynSettings) -> list[str]:
    """See :class:`proofroll.core.engine_abilities.TellsLines`: what differs from a new ``exu.SimulationSettings()``."""
    usual = dict(_leaves(exu.SimulationSettings().GetDictionary()))
    made = dict(_leaves(simulation_settings(settings, dependent=settings.formulation == "redundant").GetDictionary()))
    lines = [
        f"simulationSettings.{name} = {_literal(value)}"
        for name, value in made.items()
        if value != usual.get(name) and not name.startswith(_OF_A_RUN)
    ]
    steps = f"round(simulationSettings.timeIntegration.endTime / {settings.dt!r})"
    lines.append(f"simulationSettings.timeIntegration.numberOfSteps = {steps}")
    if settings.integrator not in EXPLICIT:
        lines.append("# newton.absoluteTolerance: as many times that as kilograms move, of more than 1 kg")
    if settings.stiffness is not None:
        lines.append(f"# contact: stiffness {settings.stiffness:g} N/m, friction zone {settings.friction_zone:g} m/s")
    return lines


def _leaves(tree: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{above}{name}.")
        else:
            yield above + name, value


def _literal(value: Any) -> str:
    """Python text of a value; of an enumeration the name that a program writes."""
    return f"exu.{type(value).__name__}.{value.name}" if hasattr(value, "name") else repr(value)
