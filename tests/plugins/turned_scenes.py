"""The same scene in a world whose axes are turned and whose origin lies elsewhere, in another order, renamed."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Mapping
from typing import Any

import numpy as np

from proofroll.core.scene import Scene
from proofroll.elements.mechanism import WORLD, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.rotations import from_rpy, to_rpy
from proofroll.elements.mechanism.scene.signal import Formula, Table, value_at, varies

# Lists of a mechanism whose order is that of its file.
LISTS = (
    "bodies",
    "joints",
    "loops",
    "springs",
    "points",
    "geometries",
    "pairs",
    "actuators",
    "couplings",
    "forces",
    "bushings",
)


def turned_mechanism(mechanism: Mechanism, rpy: tuple[float, float, float], shift: tuple[float, ...]) -> Mechanism:
    """The mechanism with all that is fixed in the world turned by roll, pitch, yaw [rad], then shifted [m]."""
    R = from_rpy(rpy)

    def position(p: Any) -> tuple[float, ...]:
        return tuple(float(x) for x in R @ np.array(p) + np.array(shift))

    def direction(a: Any) -> tuple[float, ...]:
        return tuple(float(x) for x in R @ np.array(a))

    def orientation(angles: Any) -> tuple[float, float, float]:
        return to_rpy(R @ from_rpy(angles))

    joints = [
        dataclasses.replace(joint, position=position(joint.position), orientation=orientation(joint.orientation))
        if joint.parent == WORLD
        else joint
        for joint in mechanism.joints
    ]
    loops = []
    for loop in mechanism.loops:
        changes: dict[str, Any] = {}
        for side in ("a", "b"):
            if getattr(loop, f"body_{side}") == WORLD:
                changes[f"position_{side}"] = position(getattr(loop, f"position_{side}"))
                if loop.kind not in {"fixed", "spherical"} and (side == "a" or loop.kind != "prismatic"):
                    changes[f"axis_{side}"] = direction(getattr(loop, f"axis_{side}"))
                if loop.kind in {"fixed", "prismatic"}:
                    frame = from_rpy(loop.orientation)
                    changes["orientation"] = to_rpy(R @ frame if side == "a" else frame @ R.T)
        loops.append(dataclasses.replace(loop, **changes))
    springs = [
        dataclasses.replace(
            spring,
            **{
                f"position_{side}": position(getattr(spring, f"position_{side}"))
                for side in ("a", "b")
                if getattr(spring, f"body_{side}") == WORLD
            },
        )
        for spring in mechanism.springs
    ]
    geometries = []
    for geometry in mechanism.geometries:
        changes = {}
        if geometry.body == WORLD:
            changes["position"] = position(geometry.position)
            if geometry.kind in {"plane", "circle"}:
                changes["normal"] = direction(geometry.normal)
            elif geometry.kind in {"bore", "shaft", "cone", "torus", "capsule", "cylinder"}:
                changes["axis"] = direction(geometry.axis)
            elif geometry.kind in {"box", "ellipsoid"}:
                changes["orientation"] = orientation(geometry.orientation)
        geometries.append(dataclasses.replace(geometry, **changes))
    forces = [
        dataclasses.replace(force, value=_turned_signals(force.value, R)) if force.frame == WORLD else force
        for force in mechanism.forces
    ]
    points = [
        dataclasses.replace(point, position=position(point.position)) if point.body == WORLD else point
        for point in mechanism.points
    ]
    return dataclasses.replace(
        mechanism,
        joints=tuple(joints),
        loops=tuple(loops),
        springs=tuple(springs),
        bushings=tuple(_turned_bushing(bushing, position, orientation) for bushing in mechanism.bushings),
        geometries=tuple(geometries),
        forces=tuple(forces),
        points=tuple(points),
        gravity=direction(mechanism.gravity),
    )


def _turned_bushing(bushing: Bushing, position: Any, orientation: Any) -> Bushing:
    """A bushing with its end in the world turned and shifted by these functions."""
    changes: dict[str, Any] = {}
    for side in ("a", "b"):
        if getattr(bushing, f"body_{side}") == WORLD:
            changes[f"position_{side}"] = position(getattr(bushing, f"position_{side}"))
            changes[f"orientation_{side}"] = orientation(getattr(bushing, f"orientation_{side}"))
    return dataclasses.replace(bushing, **changes)


def _turned_signals(value: Any, R: Any) -> Any:
    """Three numbers, or formulas, or tables, as components of a vector that is turned."""
    if not any(varies(part) for part in value):
        return tuple(float(x) for x in R @ np.array(value))
    if times := sorted({time for part in value if isinstance(part, Table) for time in part.times}):
        columns = np.array([np.broadcast_to(value_at(part, np.array(times)), len(times)) for part in value])
        return tuple(Table(tuple(times), tuple(float(x) for x in row)) for row in R @ columns)
    texts = [part.text if varies(part) else repr(float(part)) for part in value]
    numbers = tuple(dict.fromkeys(item for part in value if varies(part) for item in part.numbers))
    return tuple(
        Formula(" + ".join(f"({float(a)!r})*({text})" for a, text in zip(row, texts, strict=True)), numbers)
        for row in R
    )


def turned_scene(scene: Scene, rpy: tuple[float, float, float], shift: tuple[float, ...]) -> Scene:
    """The scene of one mechanism, turned and shifted as :func:`turned_mechanism`."""
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    mechanism = turned_mechanism(element.mechanism, rpy, shift)
    return dataclasses.replace(scene, elements=(dataclasses.replace(element, mechanism=mechanism),))


def shuffled(scene: Scene, order: random.Random) -> tuple[Scene, dict[str, str]]:
    """The same scene with its lists in another order and each of their names replaced; and old name -> new name."""
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    lists = {name: list(getattr(element.mechanism, name)) for name in LISTS}
    old = sorted({item.name for items in lists.values() for item in items})
    new = [f"part{number}" for number in range(len(old))]
    order.shuffle(new)
    names = dict(zip(old, new, strict=True))
    for items in lists.values():
        order.shuffle(items)
    parts: Any = {name: tuple(_renamed(item, names) for item in items) for name, items in lists.items()}
    mechanism = dataclasses.replace(element.mechanism, **parts)
    return dataclasses.replace(scene, elements=(MechanismElement(mechanism),)), names


def _renamed(item: Any, names: Mapping[str, str]) -> Any:
    """A part of a mechanism with new names, also of the parts that it refers to; a word that is no name stays."""
    words = {"kind", "unmodelled"}
    changes: dict[str, Any] = {}
    for key in (field.name for field in dataclasses.fields(item) if field.name not in words):
        value = getattr(item, key)
        if isinstance(value, str):
            changes[key] = names.get(value, value)
        elif isinstance(value, tuple) and value and all(isinstance(part, str) for part in value):
            changes[key] = tuple(names.get(part, part) for part in value)
    return dataclasses.replace(item, **changes)
