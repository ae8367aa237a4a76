"""Exudyn's modules as ``Any`` (its stubs omit ``self`` from every method), and names that differ between versions."""

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
    """Exudyn's simulation settings, in the names of the installed version: no files, no sensors.

    ``dependent``: constraints may depend on each other, so the linear solver must handle a singular matrix.
    ``explicit``: type of an explicit solver.
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
    """Adds a data node, which keeps numbers from step to step, with these initial values."""
    node = items.NodeGenericData(initialCoordinates=list(values), numberOfDataCoordinates=len(values))
    return system.AddNode(node)


def add_renamed(system: Any, item: Any, value: float, *names: str) -> Any:
    """Adds an object after setting a parameter, whose name depends on the version of Exudyn: the first that exists."""
    setattr(item, next(name for name in names if hasattr(item, name)), value)
    return system.AddObject(item)


def add_rigid_body(system: Any, mass: float, inertia: Sequence[float], node: Any) -> Any:
    """Adds a rigid body on a node: mass [kg], inertia xx, yy, zz, yz, xz, xy about the node [kg m²]."""
    item = items.ObjectRigidBody(nodeNumber=node)
    prefix = "" if hasattr(item, "mass") else "physics"
    for name, value in (("mass", mass), ("inertia", list(inertia))):
        setattr(item, _named(prefix, name), value)
    return system.AddObject(item)


def rigid_body(system: Any, number: Any) -> dict[str, Any]:
    """Rigid body as Exudyn holds it: ``mass``, ``inertia`` (as for :func:`add_rigid_body`), ``centerOfMass``."""
    item = system.GetObject(number)
    prefix = "" if "mass" in item else "physics"
    return {name: item[_named(prefix, name)] for name in ("mass", "inertia", "centerOfMass")}


def _named(prefix: str, name: str) -> str:
    return prefix + name[0].upper() + name[1:] if prefix else name


def add_kinematic_tree(
    system: Any, q: Any, v: Any, turns: Any, offsets: Any, inertias: Any, coms: Any, **others: Any
) -> Any:
    """Adds an ``ObjectKinematicTree`` and its node, which starts at the coordinates ``q`` with the rates ``v``.

    ``turns`` and ``offsets`` [m] place the joint of each link in the frame of its parent; ``inertias`` [kg m²] are
    about centres of mass ``coms`` [m]; ``others`` are further arguments of the object, as plain lists.
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
