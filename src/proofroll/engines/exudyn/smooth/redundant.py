"""Formulation ``redundant``: a mechanism of rigid bodies in Euler parameters, joints and loops as constraints.

Bodies are referenced at their centres of mass.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest
from typing import Any, ClassVar

import numpy as np

from proofroll.core.engine import Regularised
from proofroll.core.errors import Refused
from proofroll.elements.mechanism import WORLD, Mechanism, Tree
from proofroll.elements.mechanism.dynamics.held_signals import drive
from proofroll.elements.mechanism.dynamics.loop_points import normal_of_plane
from proofroll.elements.mechanism.run.capabilities import ALL_JOINTS, ALL_LOOPS, FORCES, MechanismCapability, require
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample, mechanism_of, row_rank, unsaid
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.joint_kinds import WITH_AXIS, JointKind
from proofroll.elements.mechanism.scene.rotations import Array, cross, quaternion_rate, to_quaternion
from proofroll.elements.mechanism.scene.signal import varies
from proofroll.engines.exudyn.integration import ExudynModel, Integration, initial_matrices
from proofroll.engines.exudyn.native import Output, add_rigid_body, exu, items, rigid_body
from proofroll.engines.exudyn.settings import ExudynSettings
from proofroll.engines.exudyn.smooth.connections import Connections, add_forces, add_springs
from proofroll.engines.exudyn.smooth.joint_laws import JointLaws

_OF_JOINTS = {
    MechanismCapability[name] for name in (
        "JOINT_FRICTION", "STOPS", "ACTUATORS", "SATURATION", "SIGNALS", "HELD", "COUPLINGS", "ARMATURE", "MOTIONS",
    )
}  # fmt: skip
PROVIDES = frozenset(ALL_JOINTS | ALL_LOOPS | FORCES | _OF_JOINTS | {MechanismCapability.REDUNDANT})
LACKING: Mapping[str, str] = {
    MechanismCapability.REBOUNDS: "its stops are springs with dampers, which have no coefficient of restitution"
}


_DIFFERENCED = Regularised(
    1e-5, "Exudyn differentiates the constraints' Jacobian numerically to find the accelerations at the start"
)


class Redundant(ExudynModel):
    """Run in redundant coordinates; see :class:`proofroll.core.engine.Engine` for the methods.

    Attributes:
        provides, lacking: capabilities of the formulation, and reasons for missing ones.
    """

    provides: ClassVar[frozenset[str]] = PROVIDES
    lacking: ClassVar[Mapping[str, str]] = LACKING

    def __init__(self, scene: Any, settings: ExudynSettings) -> None:
        mechanism = mechanism_of(scene)
        require(mechanism, self.provides, self.lacking)
        _check(mechanism)
        self._mechanism = mechanism
        super().__init__()
        self.bodies: dict[str, Any] = {WORLD: self.system.CreateGround()}
        self._com = {WORLD: np.zeros(3)} | {body.name: np.array(body.com) for body in mechanism.bodies}
        self._turns = _turns(mechanism)
        self._at_start = Tree(mechanism).at(*mechanism.start())
        self._add_bodies()
        self._connections = Connections(self.system, self.bodies, self._com, self._turns)
        normals = self._normals()
        self._joints = [
            self._connections.connect(between, joint, normals)
            for between, joint in zip_longest(mechanism.connections, mechanism.joints)  # loops follow the joints
        ]
        add_springs(self.system, mechanism, self.marker)
        add_bushings(self.system, mechanism, self.marker)
        add_forces(self.system, mechanism, self.marker)
        self._laws = JointLaws(self.system, mechanism, self._connections.coordinate, settings.dt)
        self._add_contacts(mechanism, settings)
        self.system.Assemble()
        rows, self._rows = self._constraint_rows(settings)
        self._rank = row_rank(self._rows)
        dependent = row_rank(rows) < len(rows)
        turning = self._turning()
        sizes = {"mass": mechanism.mass, "stiffness": self._laws.stiffness}
        self.integration = Integration(
            self.system, settings, turning, dependent=dependent, moved=self._laws.accelerations, **sizes
        )

    def drive(self, values: Array) -> None:
        """See :class:`proofroll.core.engine_abilities.TakesTargets`."""
        drive(self._mechanism, values)
        if self.integration.t:
            self.integration = self.integration.again()

    def marker(self, body: str, position: Any) -> Any:
        """Adds a marker at a place in a body's frame [m]."""
        return self._connections.marker(body, position, np.eye(3))

    def _add_bodies(self) -> None:
        system, motion = self.system, self._at_start
        for number, body in enumerate(self._mechanism.bodies):
            turn, w = self._turns[body.name], motion.w_WB[number]
            R = motion.R_WB[number] @ turn.T
            arm, q = motion.R_WB[number] @ self._com[body.name], to_quaternion(R)
            node = system.AddNode(
                items.NodeRigidBodyEP(
                    referenceCoordinates=[*(motion.p_WB[number] + arm), *q],
                    initialVelocities=[*(motion.v_WB[number] + np.cross(w, arm)), *quaternion_rate(q, R.T @ w)],
                )
            )
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = turn @ np.array(body.inertia) @ turn.T
            self.bodies[body.name] = add_rigid_body(system, body.mass, [xx, yy, zz, yz, xz, xy], node)
            marker = system.AddMarker(items.MarkerBodyMass(bodyNumber=self.bodies[body.name]))
            system.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=self._mechanism.gravity))

    def _normals(self) -> dict[str, Array]:
        """Normal of the plane of motion in the frame of each body, by name; empty if there is none."""
        normal = normal_of_plane(self._mechanism)
        if normal is None:
            return {}
        return {name: self._at_start.R_WB[number].T @ normal for name, number in self._mechanism.body_index.items()}

    def _add_contacts(self, mechanism: Mechanism, settings: ExudynSettings) -> None:
        """Adds contacts; this formulation has none."""

    def _turning(self) -> Mapping[Any, Array] | None:
        """Rates that Exudyn leaves out of constraints of contacts, see :func:`.integration.consistent_start`."""
        return None

    def _contact_rows(self) -> Sequence[int]:
        """Numbers of the constraints that are contacts."""
        return ()

    def _constraint_rows(self, settings: ExudynSettings) -> tuple[Array, Array]:
        """Constraint Jacobian on Exudyn's velocities, shape (rows, velocities), without the zero rows of free axes.

        Of all constraints, and of joints and loops alone.
        """
        mass, jacobian, _ = initial_matrices(self.system, settings, dependent=True)
        rows = jacobian[len(mass) :, : len(mass)]
        acts = np.abs(rows).max(axis=1, initial=0.0) > 0
        joints = acts & ~np.isin(np.arange(len(rows)), self._contact_rows())
        return rows[acts], rows[joints]

    def _over_bodies(self, output: Any) -> Array:
        """Exudyn's output variable at the origins of all body frames, a row for each body."""
        return np.array(
            [self._connections.body(body.name, output, -self._com[body.name]) for body in self._mechanism.bodies]
        )

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        force, torque = unsaid(self._mechanism)
        for number, made in enumerate(self._joints):
            force[number], torque[number] = self._connections.reaction(made)
        pushes = self._laws.pushes()
        axes = {n: self._connections.axes(self._joints[n])[0][:, 2] for n in {law.number for law, _ in pushes}}
        for law, push in pushes:
            vector = push * axes[law.number]
            (force if self._mechanism.joints[law.number].kind == JointKind.PRISMATIC else torque)[law.number] += vector
        return MechanismSample(
            p_WB=self._over_bodies(Output.Position),
            v_WB=self._over_bodies(Output.Velocity),
            w_WB=self._over_bodies(Output.AngularVelocity),
            q_WB=to_quaternion(self._over_bodies(Output.RotationMatrix).reshape(-1, 3, 3)),
            joint_force=force,
            joint_torque=torque,
            **self._laws.named(pushes),
        )

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        system, bodies = self.system, self._mechanism.bodies
        data = [rigid_body(system, self.bodies[body.name]) for body in bodies]
        turns = [self._turns[body.name] for body in bodies]
        joints = self._joints[: len(self._mechanism.joints)]
        axes = np.full((len(joints), 3), np.nan)
        for number, (joint, made) in enumerate(zip(self._mechanism.joints, joints, strict=True)):
            if joint.kind in WITH_AXIS:
                axes[number] = self._connections.axes(made)[0][:, 0 if joint.kind == JointKind.UNIVERSAL else 2]
        to_com = np.array(
            [
                self._connections.body(body.name, Output.RotationMatrix, np.zeros(3)).reshape(3, 3).T
                @ (self._connections.body(body.name, Output.Position, np.zeros(3)) - p)
                for body, p in zip(bodies, self._over_bodies(Output.Position), strict=True)
            ]
        )
        loads = [system.GetLoad(number) for number in range(system.systemData.NumberOfLoads())]
        return MechanismBuilt(
            mass=np.array([item["mass"] for item in data]),
            com=to_com + np.array([item["centerOfMass"] for item in data]),
            inertia=np.array([T.T @ _matrix(item["inertia"]) @ T for item, T in zip(data, turns, strict=True)]),
            joint_position=np.array(
                [
                    system.GetMarkerOutput(made.markers[1], Output.Position, exu.ConfigurationType.Current)
                    for made in joints
                ]
            ),
            joint_axis=axes,
            gravity=np.array(loads[0]["loadVector"]),
            rows=len(self._rows),
            rank=self._rank,
            mobility=self._rows.shape[1] - self._rank,
            acceleration=self._over_bodies(Output.Acceleration),
            angular_acceleration=self._over_bodies(Output.AngularAcceleration),
            regularised=dict.fromkeys(("acceleration", "angular_acceleration"), _DIFFERENCED),
        )


def _turns(mechanism: Mechanism) -> dict[str, Array]:
    """Rotation from each body's axes to those that it has in Exudyn, by body name.

    If any joint has a law along its coordinate, Exudyn's axes are parallel to the world's at q = 0, because Exudyn
    measures the coordinate as the angle between the axes of two bodies. Else they are the body's own.
    """
    turns = {WORLD: np.eye(3)} | {body.name: np.eye(3) for body in mechanism.bodies}
    laws = any(joint.friction or joint.limits or joint.armature or varies(joint.torque) for joint in mechanism.joints)
    if laws or mechanism.actuators or mechanism.couplings or mechanism.prescribed:
        for joint in mechanism.joints:  # parents first
            turns[joint.child] = turns[joint.parent] @ joint.parent_frame @ joint.child_frame.T
    return turns


def _matrix(six: Any) -> Array:
    xx, yy, zz, yz, xz, xy = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _check(mechanism: Mechanism) -> None:
    """Raises Refused for forces in universal joints, which no capability covers."""
    for joint in mechanism.joints:
        if joint.kind == JointKind.UNIVERSAL and (joint.stiffness or joint.damping or joint.friction):
            raise Refused(f"Exudyn has no torsional spring, damper or friction for the two angles of {joint.name}")


_READ = (Output.RotationMatrix, Output.Position, Output.Velocity, Output.AngularVelocity)


def add_bushings(
    system: Any, mechanism: Mechanism, marker: Callable[[str, Any], Any], turns: Mapping[str, Array] | None = None
) -> None:
    """Adds the bushings, connectors of six components with a function of their own.

    Exudyn's own law is of Tait-Bryan angles, which no energy has, and its connector applies the opposite force at the
    other end, where it changes the moment of momentum. Here its function has the moment of the rotation vector, and a
    load adds the moment that the force needs to act at one place on both bodies.

    Args:
        system: Exudyn's system.
        mechanism: with the bushings.
        marker: makes Exudyn's marker at a place in a body's frame.
        turns: body name -> rotation from the body's axes to its marker's; None: they are the same.
    """
    for bushing in mechanism.bushings:
        ends = ((bushing.body_a, bushing.position_a), (bushing.body_b, bushing.position_b))
        markers = [marker(*end) for end in ends]
        frames = [np.eye(3) if turns is None else turns[body] for body, _ in ends]
        law = _Law(bushing, markers, frames)
        system.AddObject(
            items.ObjectConnectorRigidBodySpringDamper(markerNumbers=markers, springForceTorqueUserFunction=law.wrench)
        )
        if bushing.body_a != WORLD:
            system.AddLoad(
                items.LoadTorqueVector(
                    markerNumber=markers[0], loadVector=[0.0, 0.0, 0.0], loadVectorUserFunction=law.moment_of_arm
                )
            )


class _Law:
    """Functions of one bushing for Exudyn; ``frames`` turn the axes of bodies to those of their markers."""

    def __init__(self, bushing: Bushing, markers: list[Any], frames: list[Array]) -> None:
        self._bushing, self._markers, self._frames = bushing, markers, frames

    def _load(self, system: Any) -> tuple[Array, Array, Array, Array]:
        """Rotation of the first marker, distance of the ends, force and moment on body_b, world axes."""
        now = exu.ConfigurationType.Current
        read: Any = [
            [np.array(system.GetMarkerOutput(marker, output, now)) for output in _READ] for marker in self._markers
        ]
        (axes_a, p_a, v_a, w_a), (axes_b, p_b, v_b, w_b) = read
        A = axes_a.reshape(3, 3)
        R_a, R_b = A @ self._frames[0], axes_b.reshape(3, 3) @ self._frames[1]
        force, moment = self._bushing.load(R_a, R_b, p_b - p_a, v_b - v_a, w_a, w_b)
        return A, p_b - p_a, force, moment

    def wrench(self, system: Any, *_state: Any) -> list[float]:
        """Force and moment on the first marker, in its axes."""
        A, _, force, moment = self._load(system)
        return [float(x) for x in -np.concatenate([A.T @ force, A.T @ moment])]

    def moment_of_arm(self, system: Any, *_state: Any) -> list[float]:
        """Moment of the opposite force about the end on body_a, world axes."""
        _, apart, force, _ = self._load(system)
        return [float(x) for x in -cross(apart, force)]
