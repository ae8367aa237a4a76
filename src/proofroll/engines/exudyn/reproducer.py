"""Source of a program that repeats a run with Exudyn alone, without proofroll: of a ball on a wall or a mechanism."""

import math
from typing import Any

import numpy as np

from proofroll.core.cut_out import CutOut
from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import cut_program
from proofroll.elements.mechanism import Mechanism
from proofroll.engines.exudyn.ball.generic import Generic
from proofroll.engines.exudyn.integration import Integration
from proofroll.engines.exudyn.native import exu
from proofroll.engines.exudyn.settings import ExudynSettings

_RUN = '''

def run(times):
    """Centre, velocity and angular velocity of the ball in the world at each time."""
    model = {model}(BODY, SETTINGS)
    for t in times:
        model.advance(t)
        seen = model.sample()
        yield np.array(seen.p_WB), np.array(seen.v_WB), np.array(seen.w_WB)
'''


def source(model: Any, body: RollingBall, settings: ExudynSettings) -> str:
    """Program for a ball, cut out of the adapter; see :class:`proofroll.core.engine_abilities.Reproduces`."""
    if body.flies:
        raise Refused("there is no program with impacts yet")
    if isinstance(model, Generic) and math.isfinite(body.contact.mu_static):
        raise Refused("the loop that switches Exudyn's constraint of rolling off while the ball slips is proofroll's")
    kind = type(model)
    run, never = _RUN.format(model=kind.__name__), {"SwitchedIntegration": "SwitchedIntegration = None"}
    return cut_program(body, settings, [kind], ["advance", "sample"], run, never)


_SYSTEM = """
exu.config.printToConsole = False
mbs = exu.SystemContainer().AddSystem()
for add, items in ((mbs.AddNode, NODES), (mbs.AddObject, OBJECTS), (mbs.AddMarker, MARKERS), (mbs.AddLoad, LOADS)):
    for item in items:
        add(item)
"""
_STATE = '''
mbs.Assemble()
integration = Integration(mbs, SETTINGS, dependent=DEPENDENT, mass=MASS)


def run(times):
    """Followed quantities at each time."""
    for t in times:
        integration.advance(t)
        yield seen()


def told(number, kind):
    """What Exudyn says of an object; 0 where it has no such quantity."""
    output, item = getattr(exu.OutputVariableType, kind), OBJECTS[number]
    if item["objectType"] == "RigidBody":
        return mbs.GetObjectOutputBody(number, output, [0, 0, 0])
    return mbs.GetObjectOutput(number, output)


def seen():
    """Places [m], energy [J] and how far joints and loops are open [m]."""
    where = exu.OutputVariableType.Position, exu.ConfigurationType.Current
    energy, opened = 0.0, 0.0
    for number, item in enumerate(OBJECTS):
        kind = item["objectType"]
        if kind == "RigidBody":
            weight = item["mass"] * np.array(GRAVITY)
            energy += told(number, "KineticEnergy") - weight @ told(number, "Position")
        elif kind.endswith("Mass1D"):
            rate = mbs.GetNodeOutput(item["nodeNumber"], exu.OutputVariableType.Coordinates_t)
            energy += (item.get("mass") or item.get("inertia")) * float(np.ravel(rate)[0]) ** 2 / 2
        elif kind.startswith("Connector") and kind.endswith("Damper"):  # friction, stops, couplings tell no energy
            energy += told(number, "PotentialEnergy")
        elif kind.startswith("Joint"):
            held = np.array(item.get("constrainedAxes", [1, 1, 1])[:3])
            apart = told(number, "Displacement" if kind == "JointSpherical" else "DisplacementLocal")
            opened = max(opened, np.abs(held * apart).max())
        elif kind == "KinematicTree":
            q, v = mbs.systemData.GetODE2Coordinates(), mbs.systemData.GetODE2Coordinates_t()
            integration.solver.ComputeMassMatrix(mbs, 1.0)
            energy += v @ integration.solver.GetSystemMassMatrix() @ v / 2
            energy += np.array(item["jointPControlVector"]) @ (q - item["jointPositionOffsetVector"]) ** 2 / 2
            heights = [mbs.GetMarkerOutput(marker, *where) @ GRAVITY for marker in CENTRES]
            energy -= float(np.dot(item["linkMasses"], heights))
    return [mbs.GetMarkerOutput(marker, *where) for marker in PLACES], float(energy), float(opened)
'''


def mechanism_source(model: Any, mechanism: Mechanism, settings: ExudynSettings) -> str:
    """Part of the program that runs a mechanism. Adds markers to the system of ``model``, which must be at time 0."""
    com = {body.name: body.com for body in mechanism.bodies}
    system = model.system
    places = [int(model.marker(body, position)) for body, position in mechanism.followed]
    centres = [int(model.marker(joint.child, com[joint.child])) for joint in mechanism.joints]
    cut = CutOut([Integration], ["advance", "solver"])
    text = [f"{cut.head}\n{cut.text}\n\n# The system as Exudyn lists it.\n"]
    data = system.systemData
    for name in ("Node", "Object", "Marker", "Load"):
        count, get = getattr(data, f"NumberOf{name}s")(), getattr(system, f"Get{name}")
        lines = "".join(f"    {_literal(_essential(get(number)))},\n" for number in range(count))
        text.append(f"{name.upper()}S = [\n{lines}]\n")
    text.append(f"GRAVITY = {list(mechanism.gravity)!r}\n# Markers of what is followed, and of the centres of mass.\n")
    text.append(f"PLACES = {places!r}\nCENTRES = {centres!r}\n{_SYSTEM}SETTINGS = {cut.literal(settings)}\n")
    text.append(f"DEPENDENT = {model.integration.options.linearSolver.ignoreSingularJacobian!r}\n")
    text.append(f"MASS = {mechanism.mass!r}\n")
    return "".join([*text, _STATE])


def _essential(item: dict[str, Any]) -> dict[str, Any]:
    """Item of Exudyn without drawing, name and duplicate entries. Raises Refused for one with a user function."""
    if any(isinstance(value, dict) and "function" in value for value in item.values()):
        raise Refused("efforts that change in time or have a limit are functions, which programs do not hold yet")
    twice = {"jointHTs", "referenceHT", "referenceRotation"} | ({"localPosition"} if "localHT" in item else set())
    if "Relative" in item.get("markerType", "") and "nodeNumber" in item:
        item = item | {"markerType": "BodiesRelativeRotationCoordinate"}  # Exudyn 1.13 lists it as one of translation
    return {
        key: value
        for key, value in item.items()
        if not (key.startswith("V") or key in twice or key == "name" or "UserFunction" in key)
    }


def _literal(value: Any) -> str:
    """Python source of a value of Exudyn's."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key!r}: {_literal(item)}" for key, item in value.items()) + "}"
    if isinstance(value, np.ndarray):
        return repr(value.tolist())
    if hasattr(value, "GetIndex"):
        return repr(value.GetIndex())
    if isinstance(value, exu.JointType):
        return f"exu.JointType.{value.name}"
    if isinstance(value, (bool, int, float, str)):
        return repr(value)
    inner, name = ", ".join(_literal(value[number]) for number in range(len(value))), type(value).__name__
    return f"exu.{name}([{inner}])" if name.endswith("DList") else f"[{inner}]"
