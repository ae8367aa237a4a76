"""Exudyn's modules without types: its stubs leave ``self`` out of every method and so describe other signatures."""

from collections.abc import Sequence
from typing import Any

import exudyn
import exudyn.itemInterface
import numpy as np

exu: Any = exudyn
items: Any = exudyn.itemInterface
Output: Any = exudyn.OutputVariableType
# In 1.11 settings and properties of bodies have other names than in 1.13, and errors are Python's own.
ExudynError: Any = getattr(exudyn, "ExudynError", RuntimeError)


def new_settings(*, dependent: bool, explicit: Any = None) -> Any:
    """Exudyn's simulation settings, by the names of its version: no files, no sensors.

    Constraints that may be ``dependent`` need a linear solver that looks for it; ``explicit`` is the type of an
    explicit solver.
    """
    settings = exu.SimulationSettings()
    renamed = not hasattr(settings, "solution")
    if dependent:
        kind = exu.LinearSolverType.EigenDense
        if renamed:
            settings.linearSolverType = kind
        else:
            settings.linearSolver.solverType = kind
        (settings.linearSolverSettings if renamed else settings.linearSolver).ignoreSingularJacobian = True
    if renamed:
        settings.solutionSettings.writeSolutionToFile = settings.solutionSettings.sensorsStoreAndWriteFiles = False
    else:
        settings.solution.file.write = settings.solution.sensors.active = False
    if explicit is not None:
        time = settings.timeIntegration
        if renamed:
            time.explicitIntegration.dynamicSolverType = explicit
        else:
            time.solverType = explicit
    return settings


def data_node(system: Any, *values: float) -> Any:
    """A node that keeps numbers from step to step."""
    node = items.NodeGenericData(initialCoordinates=list(values), numberOfDataCoordinates=len(values))
    return system.AddNode(node)


def add_renamed(system: Any, item: Any, value: float, *names: str) -> Any:
    """Adds an object whose parameter has one of these names, by the version of Exudyn."""
    setattr(item, next(name for name in names if hasattr(item, name)), value)
    return system.AddObject(item)


def add_rigid_body(system: Any, mass: float, inertia: Sequence[float], node: Any) -> Any:
    """A rigid body on a node: mass [kg], moments and products xx, yy, zz, yz, xz, xy about the node [kg m²]."""
    made = items.ObjectRigidBody(nodeNumber=node)
    prefix = "" if hasattr(made, "mass") else "physics"
    for name, value in (("mass", mass), ("inertia", list(inertia))):
        setattr(made, _named(prefix, name), value)
    return system.AddObject(made)


def rigid_body(system: Any, number: Any) -> dict[str, Any]:
    """Rigid body as Exudyn holds it: ``mass``, ``inertia`` as above, ``centerOfMass``."""
    item = system.GetObject(number)
    prefix = "" if "mass" in item else "physics"
    return {name: item[_named(prefix, name)] for name in ("mass", "inertia", "centerOfMass")}


def _named(prefix: str, name: str) -> str:
    return prefix + name[0].upper() + name[1:] if prefix else name


def add_kinematic_tree(
    system: Any, q: Any, v: Any, turns: Any, offsets: Any, inertias: Any, coms: Any, **others: Any
) -> Any:
    """An ``ObjectKinematicTree`` with a node of its own, which starts at the coordinates ``q`` with the rates ``v``.

    Of each link: rotation and offset [m] of its joint in the frame of its parent, its inertia about the centre of mass
    [kg m²], and where that is [m]; ``others`` are arguments of the object that are plain lists.
    """
    size = len(turns)
    # all at full length, or Exudyn ignores them
    laws = dict.fromkeys(("Force", "PControl", "DControl", "PositionOffset", "VelocityOffset"), [0.0] * size)
    node = system.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=np.zeros(size),
            initialCoordinates=q,
            initialCoordinates_t=v,
            numberOfODE2Coordinates=size,
        )
    )
    return system.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=node,
            jointTransformations=exu.Matrix3DList(list(turns)),
            jointOffsets=exu.Vector3DList(list(offsets)),
            linkInertiasCOM=exu.Matrix3DList(list(inertias)),
            linkCOMs=exu.Vector3DList(list(coms)),
            **{f"joint{name}Vector": numbers for name, numbers in laws.items()} | others,
        )
    )


def loads(system: Any) -> list[str]:
    """Exudyn's names of the types of all loads in a system."""
    return [str(system.GetLoad(number)["loadType"]) for number in range(system.systemData.NumberOfLoads())]
