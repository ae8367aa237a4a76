"""Laws along coordinates of joints: dry friction and stops, actuators, drives in time, couplings, motions, armature.

Friction and stops are Exudyn's ``CoordinateSpringDamperExt``. Friction is a bristle: a spring and damper that slips at
the friction's force. A stop is a spring and damper. Their stiffness and damping, which the scene does not have, stop
what the joint carries at the start within a step, so that their deflection vanishes with the step. A servo with a
constant target and no limit is a ``CoordinateSpringDamper``; any other effort is a user function of one, evaluated at
every iterate. A coupling is an ``ObjectConnectorCoordinate``; another one holds the rotor of an armature to its joint.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from proofroll.elements.mechanism import Joint, Mechanism
from proofroll.elements.mechanism.dynamics.matrices import matrices_of
from proofroll.elements.mechanism.dynamics.named_forces import joint_force_shares, lengths
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import value_at, varies
from proofroll.engines.exudyn.native import Output, add_renamed, data_node, items


class JointLaw(NamedTuple):
    """Force of an Exudyn object along the coordinate of a joint.

    Attributes:
        item: Exudyn's object.
        number: number of the joint.
        factor: force along the coordinate over the force that Exudyn reports.
        field: of a sample, that holds the force; ``joint``: friction or stop; empty for drives in time and armature.
        entry: index in that field; of friction and stops the joint's ``number`` stands for it.
    """

    item: Any
    number: int
    factor: float = -1.0
    field: str = ""
    entry: int = 0


class JointLaws:
    """The laws of a mechanism, added to a system; ``stiffness``: of the stiffest bristle or stop [N/m, N m/rad]."""

    def __init__(self, system: Any, mechanism: Mechanism, coordinate: Callable[[Joint], Any], dt: float) -> None:
        """``coordinate`` makes Exudyn's marker of a joint's coordinate; ``dt`` is the step [s]."""
        self._system, self._mechanism, self._new_coordinate, self._dt = system, mechanism, coordinate, dt
        self._coordinates: dict[str, Any] = {}
        self._ground: Any = None
        self.stiffness = 0.0
        self._laws: list[JointLaw] = []
        held = any(joint.friction or joint.limits for joint in mechanism.joints)
        inertias = np.diag(matrices_of(mechanism).mass_matrix) if held else np.zeros(mechanism.nv)
        rates = mechanism.start()[1]
        for joint, at_v in zip(mechanism.joints, mechanism.v_slices, strict=True):
            if joint.friction or joint.limits:
                law = self._holding(joint, float(inertias[at_v.start]), float(rates[at_v.start]))
                self._add(law, joint.name, field="joint")
            if varies(joint.torque):
                self._add(self._pushing(joint.name, _drive(joint)), joint.name)
            if joint.armature:
                self._add(self._rotor(joint), joint.name, factor=1.0)
        for entry, actuator in enumerate(mechanism.actuators):
            self._add(self._acting(actuator), actuator.joint, field="effort", entry=entry)
        for entry, coupling in enumerate(mechanism.couplings):
            (follower, _), (leader, factor) = coupling.terms
            item = self._coupled([self._coordinate(follower), self._coordinate(leader)], -factor, coupling.place)
            self._add(item, follower, factor=1.0, field="coupling", entry=entry)
            self._add(item, leader, factor=factor)
        for joint, _, _ in mechanism.prescribed:
            number = mechanism.joint_index[joint.name]
            self._add(self._moved(joint), joint.name, field="drive", entry=number)

    def _add(self, item: Any, joint: str, **others: Any) -> None:
        self._laws.append(JointLaw(item, self._mechanism.joint_index[joint], **others))

    def _coordinate(self, name: str) -> Any:
        """Marker of the coordinate of a joint."""
        if name not in self._coordinates:
            joint = self._mechanism.joints[self._mechanism.joint_index[name]]
            self._coordinates[name] = self._new_coordinate(joint)
        return self._coordinates[name]

    def _ends(self, joint: str) -> list[Any]:
        """Markers of the ground and of the coordinate of a joint."""
        if self._ground is None:
            node = self._system.AddNode(items.NodePointGround())
            self._ground = self._system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        return [self._ground, self._coordinate(joint)]

    def _holding(self, joint: Joint, inertia: float, rate: float) -> Any:
        """Adds friction and stops; ``inertia``: of all that the joint carries, along its coordinate [kg, kg m²].

        ``rate``: of the coordinate at the start. The first number of Exudyn's data node is the sense of the slip at
        the start; a bristle at rest has 1.
        """
        law = dict[str, Any]()
        self.stiffness = max(self.stiffness, inertia / self._dt**2)
        if joint.friction:
            law["dynamicFrictionForce"] = joint.friction
            law["stickingStiffness"], law["stickingDamping"] = inertia / self._dt**2, 2 * inertia / self._dt
        if joint.limits:
            law |= {"useLimitStops": True, "limitStopsLower": joint.limits[0], "limitStopsUpper": joint.limits[1]}
            law["limitStopsStiffness"], law["limitStopsDamping"] = inertia / self._dt**2, 2 * inertia / self._dt
        sense = (-1.0 if rate < 0 else 1.0) if joint.friction else 0.0
        return self._system.AddObject(
            items.ObjectConnectorCoordinateSpringDamperExt(
                markerNumbers=self._ends(joint.name), nodeNumber=data_node(self._system, sense, 0.0, 0.0), **law
            )
        )

    def _pushing(self, joint: str, push: Callable[[float, float, float], float]) -> Any:
        """Adds a force along a joint's coordinate, given as a function of time, coordinate and rate."""

        def pull(system: Any, t: float, item: int, q: float, v: float, *law: float) -> float:  # noqa: ARG001 -- Exudyn's signature
            return -push(t, q, v)

        return self._system.AddObject(
            items.ObjectConnectorCoordinateSpringDamper(markerNumbers=self._ends(joint), springForceUserFunction=pull)
        )

    def _acting(self, actuator: Actuator) -> Any:
        """Adds an actuator: a spring and damper if its law is linear and constant, else a user function."""
        if actuator.kind != "position" or actuator.limit is not None or varies(actuator.target):
            return self._pushing(actuator.joint, actuator.law())
        n = actuator.gear
        return self._system.AddObject(
            items.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=self._ends(actuator.joint),
                stiffness=n * n * actuator.kp,
                damping=n * n * actuator.kd,
                offset=value_at(actuator.target, 0.0) / n,
            )
        )

    def _coupled(self, markers: list[Any], ratio: float, offset: float) -> Any:
        """Adds a constraint: first coordinate = ``ratio`` times the second + ``offset``."""
        item = items.ObjectConnectorCoordinate(markerNumbers=markers, offset=-offset)
        return add_renamed(self._system, item, ratio, "factor1", "factorValue1")

    def _moved(self, joint: Joint) -> Any:
        """Adds a constraint that moves a joint's coordinate as prescribed; Exudyn asks for its rate, too."""
        signal = joint.motion
        assert signal is not None  # as of all prescribed ones

        def place(system: Any, t: float, item: int, offset: float) -> float:  # noqa: ARG001 -- Exudyn's signature
            return float(moved(signal, t).place)

        def rate(system: Any, t: float, item: int, offset: float) -> float:  # noqa: ARG001 -- Exudyn's signature
            return float(moved(signal, t).rate)

        return self._system.AddObject(
            items.ObjectConnectorCoordinate(
                markerNumbers=self._ends(joint.name), offsetUserFunction=place, offsetUserFunction_t=rate
            )
        )

    def accelerations(self, t: float) -> dict[Any, float]:
        """Acceleration that each constraint of a prescribed motion asks for at a time [s], by Exudyn's object."""
        moving = {law.item: self._mechanism.joints[law.number].motion for law in self._laws if law.field == "drive"}
        return {item: float(moved(signal, t).acceleration) for item, signal in moving.items() if signal is not None}

    def _rotor(self, joint: Joint) -> Any:
        """Adds a rotor with the inertia of the joint's armature, constrained to the joint's coordinate."""
        system = self._system
        node = system.AddNode(items.Node1D(initialCoordinates=[joint.q0[0]], initialVelocities=[joint.v0[0]]))
        if joint.kind == JointKind.PRISMATIC:
            add_renamed(system, items.ObjectMass1D(nodeNumber=node), joint.armature, "mass", "physicsMass")
        else:
            item = items.ObjectRotationalMass1D(nodeNumber=node)
            add_renamed(system, item, joint.armature, "inertia", "physicsInertia")
        marker = system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        return self._coupled([self._coordinate(joint.name), marker], 1.0, 0.0)

    def pushes(self) -> list[tuple[JointLaw, float]]:
        """Each law with its force along the coordinate of its joint [N, N m]."""
        forces = [self._system.GetObjectOutput(law.item, Output.Force) for law in self._laws]
        return [(law, law.factor * float(np.ravel(force)[0])) for law, force in zip(self._laws, forces, strict=True)]

    def named(self, pushes: list[tuple[JointLaw, float]]) -> dict[str, Array]:
        """Fields of a sample: friction and stops by joint, efforts by actuator, forces by coupling [N, N m]."""
        forces = {name: np.full(count, np.nan) for name, count in lengths(self._mechanism).items()}
        for law, push in pushes:
            if law.field == "joint":
                joint = self._mechanism.joints[law.number]
                parts = joint_force_shares(bool(joint.limits), joint.friction, push)
                forces["friction"][law.number], forces["stop"][law.number] = parts
            elif law.field:
                forces[law.field][law.entry] = push
        return forces if pushes else {}


def _drive(joint: Joint) -> Callable[[float, float, float], float]:
    return lambda t, _q, _v: float(value_at(joint.torque, t))
