"""Source of a program that repeats a run of a mechanism with Exudyn alone, without proofroll."""

from typing import Any

import numpy as np

from proofroll.core.errors import Refused
from proofroll.core.program_text import assignment
from proofroll.elements.mechanism import Mechanism
from proofroll.engines.exudyn.settings import EXPLICIT, ExudynSettings

_HEAD = "from __future__ import annotations\nimport exudyn as exu\nimport numpy as np\n\n\n"
_STATE = '''
exu.config.printToConsole = False
mbs = exu.SystemContainer().AddSystem()
for add, items in ((mbs.AddNode, NODES), (mbs.AddObject, OBJECTS), (mbs.AddMarker, MARKERS), (mbs.AddLoad, LOADS)):
    for item in items:
        add(item)
mbs.Assemble()
settings = exu.SimulationSettings()
settings.SetDictionary(SETTINGS)
solver = SOLVER()
solver.InitializeSolver(mbs, settings)


def run(times):
    """Followed quantities at each time."""
    last = 0.0
    for t in times:
        if t > last:
            solver.it.startTime, solver.it.currentTime, solver.it.endTime = last, last, t
            solver.it.numberOfSteps = round((t - last) / DT)
            if not solver.SolveSteps(mbs, settings) or abs(solver.it.currentTime - t) > DT / 2:
                raise RuntimeError(f"Exudyn stopped at {solver.it.currentTime:g} s: {solver.GetErrorString()}")
            last = t
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
            solver.ComputeMassMatrix(mbs, 1.0)
            energy += v @ solver.GetSystemMassMatrix() @ v / 2
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
    text = [f"{_HEAD}# The system as Exudyn lists it.\n"]
    data = system.systemData
    for name in ("Node", "Object", "Marker", "Load"):
        count, get = getattr(data, f"NumberOf{name}s")(), getattr(system, f"Get{name}")
        lines = "".join(f"    {_literal(_essential(get(number)))},\n" for number in range(count))
        text.append(f"{name.upper()}S = [\n{lines}]\n")
    text.append(f"GRAVITY = {list(mechanism.gravity)!r}\n# Markers of what is followed, and of the centres of mass.\n")
    solver = "MainSolverExplicit" if settings.integrator in EXPLICIT else "MainSolverImplicitSecondOrder"
    text.append(assignment(DT=settings.dt, PLACES=places, CENTRES=centres))
    text.append(f"SETTINGS = {_literal(model.integration.options.GetDictionary())}\nSOLVER = exu.{solver}\n")
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
    if hasattr(value, "name"):  # of an enumeration
        return f"exu.{type(value).__name__}.{value.name}"
    if isinstance(value, (bool, int, float, str)):
        return repr(value)
    inner, name = ", ".join(_literal(value[number]) for number in range(len(value))), type(value).__name__
    return f"exu.{name}([{inner}])" if name.endswith("DList") else f"[{inner}]"
