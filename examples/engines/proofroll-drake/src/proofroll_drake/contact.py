"""Contacts of bodies in a discrete plant of Drake: spheres, ellipsoids and planes, with Drake's soft point contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.geometry import (
    AddContactMaterial,
    CollisionFilterDeclaration,
    Ellipsoid,
    GeometrySet,
    HalfSpace,
    ProximityProperties,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction, DiscreteContactApproximation

from proofroll.adapter import ContactDynamics, Family, Mechanism, MechanismBuilt, Refused, of_contact
from proofroll_drake.settings import DrakeSettings

APPROXIMATIONS: Mapping[str, DiscreteContactApproximation] = {
    "tamsi": DiscreteContactApproximation.kTamsi,
    "sap": DiscreteContactApproximation.kSap,
    "lagged": DiscreteContactApproximation.kLagged,
}
# Stiffness of a pair [N/m], Hunt-Crossley dissipation [s/m], slip speed up to which friction counts as sticking [m/s].
STIFFNESS, DISSIPATION, STICTION = 1e6, 50.0, 1e-4


def family(settings: DrakeSettings) -> Mapping[str, str]:
    """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
    kind = Family.CONVEX if settings.contact == "sap" else Family.SOFTENED
    return of_contact(kind, stiffness=STIFFNESS, zone=STICTION) if settings.formulation == "contact" else {}


class DrakeContacts:
    """Geometries of a mechanism in a plant, and their contact forces.

    Args:
        mechanism: mechanism with one law for all its pairs.
        plant: discrete plant with a scene graph, not finalised.
        scene_graph: scene graph of the plant.
        bodies: bodies of the plant, by name.
        settings: settings with the approximation of contact.

    Raises:
        Refused: pairs have different coefficients of friction, or a shape that Drake's point contact lacks.
    """

    def __init__(
        self, mechanism: Mechanism, plant: Any, scene_graph: Any, bodies: Mapping[str, Any], settings: DrakeSettings
    ) -> None:
        self._mechanism, self._plant = mechanism, plant
        self._shapes = {each.name: each for each in mechanism.geometries}
        if len({pair.friction for pair in mechanism.pairs}) > 1:
            raise Refused("Drake mixes coefficients of two surfaces; pairs with laws of their own are not built")
        plant.set_discrete_contact_approximation(APPROXIMATIONS[settings.contact])
        plant.set_stiction_tolerance(STICTION)
        dynamics = ContactDynamics(mechanism)
        start = dynamics.solve(*mechanism.start(), dynamics.begin()[0])
        sunk = dict.fromkeys(self._shapes, 0.0)
        for pair, force, each in zip(mechanism.pairs, start.force, start.state.touching, strict=False):
            round_ = next(name for name in pair.geometries if self._shapes[name].kind != "plane")
            sunk[round_] = max(sunk[round_], float(force @ each.normal) / STIFFNESS)
        friction = mechanism.pairs[0].friction
        self._ids = {
            name: plant.RegisterCollisionGeometry(
                bodies[shape.body],
                RigidTransform(RotationMatrix(shape.frame), shape.position),
                _shape(shape, sunk[name]),
                name,
                _properties(friction),
            )
            for name, shape in self._shapes.items()
        }
        manager = scene_graph.collision_filter_manager()
        manager.Apply(CollisionFilterDeclaration().ExcludeWithin(GeometrySet(list(self._ids.values()))))
        for pair in mechanism.pairs:
            a, b = (GeometrySet(self._ids[name]) for name in pair.geometries)
            manager.Apply(CollisionFilterDeclaration().AllowBetween(a, b))

    def forces(self, context: Any) -> Any:
        """Force on the first body of each pair [N], (pairs, 3)."""
        found = np.zeros((len(self._mechanism.pairs), 3))
        told = self._plant.get_contact_results_output_port().Eval(context)
        pairs = {tuple(self._ids[name] for name in pair.geometries): k for k, pair in enumerate(self._mechanism.pairs)}
        for k in range(told.num_point_pair_contacts()):
            info = told.point_pair_contact_info(k)
            pair = info.point_pair()
            on_b = np.array(info.contact_force())
            if (number := pairs.get((pair.id_A, pair.id_B))) is not None:
                found[number] -= on_b
            elif (number := pairs.get((pair.id_B, pair.id_A))) is not None:
                found[number] += on_b
        return found

    def built(self, found: MechanismBuilt) -> MechanismBuilt:
        """Certificate data with the coefficients of the contacts added."""
        count = len(self._mechanism.pairs)
        friction = self._mechanism.pairs[0].friction
        return replace(
            found,
            contact_friction=np.full(count, friction),
            contact_restitution=np.zeros(count),
        )


def _properties(friction: float) -> ProximityProperties:
    """Material of a surface, with twice the stiffness of a pair, whose surfaces are springs in series."""
    made = ProximityProperties()
    AddContactMaterial(DISSIPATION, 2 * STIFFNESS, CoulombFriction(friction, friction), made)
    return made


def _shape(shape: Any, sunk: float) -> Any:
    """Drake's shape, enlarged by its depth ``sunk`` at the start [m]."""
    if shape.kind == "sphere":
        return Sphere(shape.radius + sunk)
    if shape.kind == "ellipsoid":
        return Ellipsoid(np.array(shape.axes) + sunk)
    return HalfSpace()
