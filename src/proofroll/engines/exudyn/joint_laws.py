"""Dry friction and stops of joints by Exudyn's own law along a coordinate, ``CoordinateSpringDamperExt``.

Friction holds by a bristle, a spring and damper that slips at the friction's force; a stop is a spring and damper. Both
have the stiffness and damping that stop the joint's child within a step, so that what they give way by goes with the
step: neither is part of the scene.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.named_forces import on_joint
from proofroll.elements.mechanism.rotations import Array
from proofroll.engines.exudyn.native import Output, items


class JointLaw(NamedTuple):
    """Exudyn's object for the friction and stops of a joint, and the number of that joint."""

    item: Any
    number: int


def add_laws(system: Any, mechanism: Mechanism, bodies: Any, com: Any, dt: float) -> list[JointLaw]:
    """The laws of all joints that have dry friction or stops; ``dt`` is the step [s]."""
    by_name = {body.name: body for body in mechanism.bodies}
    return [
        JointLaw(_add(system, joint, by_name[joint.child], bodies, com, dt), number)
        for number, joint in enumerate(mechanism.joints)
        if joint.friction or joint.limits
    ]


def _add(system: Any, joint: Joint, child: Body, bodies: Any, com: Any, dt: float) -> Any:
    def data(*values: float) -> Any:
        node = items.NodeGenericData(initialCoordinates=list(values), numberOfDataCoordinates=len(values))
        return system.AddNode(node)

    between: dict[str, Any] = {
        "bodyNumbers": [bodies[joint.parent], bodies[joint.child]],
        "localPosition0": np.array(joint.position) - com[joint.parent],
        "localPosition1": np.array(joint.child_position) - com[joint.child],
        "axis0": joint.parent_frame[:, 2],
    }
    if joint.kind == "prismatic":
        coordinate = items.MarkerBodiesRelativeTranslationCoordinate(**between)
    else:  # the node counts whole turns
        coordinate = items.MarkerBodiesRelativeRotationCoordinate(nodeNumber=data(joint.q0[0]), **between)
    ground = items.MarkerNodeCoordinate(nodeNumber=system.AddNode(items.NodePointGround()), coordinate=0)
    inertia, law = _inertia(joint, child), dict[str, Any]()
    if joint.friction:
        law["dynamicFrictionForce"] = joint.friction
        law["stickingStiffness"], law["stickingDamping"] = inertia / dt**2, 2 * inertia / dt
    if joint.limits:
        law |= {"useLimitStops": True, "limitStopsLower": joint.limits[0], "limitStopsUpper": joint.limits[1]}
        law["limitStopsStiffness"], law["limitStopsDamping"] = inertia / dt**2, 2 * inertia / dt
    return system.AddObject(
        items.ObjectConnectorCoordinateSpringDamperExt(
            markerNumbers=[system.AddMarker(ground), system.AddMarker(coordinate)],
            nodeNumber=data(1.0 if joint.friction else 0.0, 0.0, 0.0),  # 1: the bristle is at rest
            **law,
        )
    )


def _inertia(joint: Joint, child: Body) -> float:
    """Inertia of the child alone against the joint's coordinate [kg, kg m²]."""
    if joint.kind == "prismatic":
        return child.mass
    axis = joint.child_frame[:, 2]
    arm = np.cross(axis, np.array(child.com) - joint.child_position)
    return float(axis @ np.asarray(child.inertia) @ axis + child.mass * arm @ arm)


def along_joints(system: Any, mechanism: Mechanism, laws: list[JointLaw]) -> dict[str, Array]:
    """Forces of dry friction and of stops along the coordinates of joints."""
    found = np.full((2, len(mechanism.joints)), np.nan)
    for law in laws:
        joint = mechanism.joints[law.number]
        found[:, law.number] = on_joint(bool(joint.limits), joint.friction, force_of(system, law))
    return {"friction": found[0], "stop": found[1]}


def force_of(system: Any, law: JointLaw) -> float:
    """Force along the coordinate on the child [N, N m]."""
    return -float(np.ravel(system.GetObjectOutput(law.item, Output.Force))[0])
