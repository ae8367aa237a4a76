"""The same mechanism in a world whose axes are turned and whose origin lies elsewhere."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.checks import WORLD
from proofroll.elements.mechanism.element import MechanismElement
from proofroll.elements.mechanism.rotations import from_rpy, to_rpy


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
            elif geometry.kind == "bore":
                changes["axis"] = direction(geometry.axis)
            elif geometry.kind in {"box", "ellipsoid"}:
                changes["orientation"] = orientation(geometry.orientation)
        geometries.append(dataclasses.replace(geometry, **changes))
    points = [
        dataclasses.replace(point, position=position(point.position)) if point.body == WORLD else point
        for point in mechanism.points
    ]
    return dataclasses.replace(
        mechanism,
        joints=tuple(joints),
        loops=tuple(loops),
        springs=tuple(springs),
        geometries=tuple(geometries),
        points=tuple(points),
        gravity=direction(mechanism.gravity),
    )


def turned_scene(scene: Scene, rpy: tuple[float, float, float], shift: tuple[float, ...]) -> Scene:
    """The scene of one mechanism, turned and shifted as :func:`turned_mechanism`."""
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    mechanism = turned_mechanism(element.mechanism, rpy, shift)
    return dataclasses.replace(scene, elements=(dataclasses.replace(element, mechanism=mechanism),))
