"""Shapes that may touch, as Rapier's colliders; which pairs touch is what groups of colliders tell."""

from __future__ import annotations

from typing import Any

import numpy as np
import rapier3d
from scipy.spatial.transform import Rotation

from proofroll.adapter import Mechanism, Refused, frame_of_axis
from proofroll_rapier.poses import isometry

# Groups that Rapier tells apart.
_GROUPS = 32
# Radius of the sphere that stands for a point [m].
_POINT = 1e-6


def add_colliders(mechanism: Mechanism, world: Any, handles: dict[str, Any]) -> None:
    """Adds the shapes of all pairs to their bodies.

    Raises:
        Refused: Rapier has no such shape, too few groups, or its coefficients cannot be those of all pairs.
    """
    touching = {name for pair in mechanism.pairs for name in pair.geometries}
    shapes = [item for item in mechanism.geometries if item.name in touching]
    if len(shapes) > _GROUPS:
        raise Refused(f"{len(shapes)} shapes touch, and Rapier tells {_GROUPS} groups apart")
    group = {item.name: 1 << number for number, item in enumerate(shapes)}
    for item in shapes:
        pairs = [pair for pair in mechanism.pairs if item.name in pair.geometries]
        laws = {(pair.friction, pair.restitution) for pair in pairs}
        if len(laws) > 1:
            raise Refused(f"{item.name}: Rapier's coefficients are of shapes, and those of its pairs differ")
        ((friction, restitution),) = laws
        partners = sum({group[name] for pair in pairs for name in pair.geometries if name != item.name})
        made = _collider(item).density(0.0).friction(friction).restitution(restitution)
        # both shapes of a pair have its coefficients, so that their minimum is that of the pair
        least = rapier3d.CoefficientCombineRule.MIN
        made = made.friction_combine_rule(least).restitution_combine_rule(least)
        groups = rapier3d.InteractionGroups(rapier3d.Group(group[item.name]), rapier3d.Group(partners))
        world.add_collider(made.collision_groups(groups), handles[item.body])


def _collider(item: Any) -> Any:
    """Rapier's shape in the pose that it has on its body."""
    colliders, rotation = rapier3d.Collider, np.eye(3)
    if item.kind == "sphere":
        made = colliders.ball(max(item.radius, _POINT))
    elif item.kind == "plane":
        made = colliders.halfspace(tuple(item.normal))
    elif item.kind == "box":
        made = colliders.cuboid(*(np.array(item.size) / 2))
        rotation = Rotation.from_euler("xyz", item.orientation).as_matrix()
    else:
        stands = colliders.capsule_y if item.kind == "capsule" else colliders.cylinder
        made = stands(item.length / 2, item.radius)
        rotation = np.roll(frame_of_axis(np.array(item.axis)), -1, axis=1)  # those of Rapier stand on y
    return made.position(isometry(item.position, rotation))
