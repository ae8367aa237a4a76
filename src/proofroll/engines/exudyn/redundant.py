"""Formulation ``redundant``: a mechanism of rigid bodies in Euler parameters, joints and loops as constraints.

Bodies are referenced at their centres of mass. Each joint is one object with two markers, whose frames are the joint's
own: Exudyn's reactions are given along the first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.engine import Regularised, Sample
from proofroll.core.errors import Refused
from proofroll.engines.exudyn.integration import Integration, initial_matrices, new_system
from proofroll.engines.exudyn.native import Output, exu, items
from proofroll.engines.exudyn.settings import ExudynSettings
from proofroll.mechanisms import WORLD, Joint, Loop, Mechanism, Tree
from proofroll.mechanisms.capabilities import ALL_JOINTS, ALL_LOOPS, FORCES, MechanismCapability, require
from proofroll.mechanisms.loop_points import is_planar
from proofroll.mechanisms.rotations import Array, cross, quaternion_rate, to_quaternion
from proofroll.mechanisms.sampling import WITH_AXIS, MechanismBuilt, independent, mechanism_of, unsaid

PROVIDES = frozenset(ALL_JOINTS | ALL_LOOPS | FORCES | {MechanismCapability.REDUNDANT})
LACKING: Mapping[str, str] = {
    MechanismCapability.JOINT_FRICTION: "this model has no friction in joints",
    MechanismCapability.ARMATURE: "Exudyn's joints between bodies have no inertia of their own",
}
# What Exudyn's joints hold between two frames: three translations and three rotations, in the axes of the first.
_HELD = {
    "fixed": (1, 1, 1, 1, 1, 1),
    "prismatic": (1, 1, 0, 1, 1, 1),
    "universal": (1, 1, 1, 0, 1, 0),
    "planar": (0, 0, 1, 1, 1, 0),
}
# A revolute loop of a planar mechanism: what else it holds is held already.
_IN_PLANE = (1, 1, 0, 0, 0, 0)
# Which axes (of the first, of the second frame) each rotational row keeps perpendicular. ``TorqueLocal`` is no moment:
# its components are these rows' multipliers. Found from the rows' residuals; Exudyn's documents do not say it.
_THREE, _TWO = ((2, 1), (2, 0), (0, 1)), ((2, 0), (2, 1))
_ROWS = {"fixed": _THREE, "prismatic": _THREE, "revolute": _TWO, "planar": _TWO, "universal": (None, (0, 2))}


_DIFFERENCED = Regularised(
    1e-5, "Exudyn differentiates the constraints' Jacobian numerically to find the accelerations at the start"
)


class _Made(NamedTuple):
    """A joint or loop: Exudyn's constraint, its own spring, its markers and bodies, and their frames of the joint.

    ``rows`` are those of :data:`_ROWS`, between the frames as they are, or permuted, in Exudyn.
    """

    kind: str
    constraint: Any
    spring: Any
    markers: list[Any]
    bodies: tuple[str, str]
    frames: tuple[Array, Array]
    rows: tuple[tuple[int, int] | None, ...]


class Redundant:
    """See :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, scene: Any, settings: ExudynSettings) -> None:
        mechanism = mechanism_of(scene)
        require(mechanism, PROVIDES, LACKING)
        _check(mechanism)
        self._mechanism = mechanism
        self._container, self._system = new_system()
        self._bodies: dict[str, Any] = {WORLD: self._system.CreateGround()}
        self._com = {WORLD: np.zeros(3)} | {body.name: np.array(body.com) for body in mechanism.bodies}
        self._add_bodies()
        planar = is_planar(mechanism)
        self._joints = [
            self._join(
                joint,
                joint.parent,
                joint.child,
                joint.position,
                joint.child_position,
                joint.parent_frame,
                joint.child_frame,
                flat=False,
            )
            for joint in mechanism.joints
        ] + [
            self._join(
                loop,
                loop.body_a,
                loop.body_b,
                loop.position_a,
                loop.position_b,
                loop.frame_a,
                loop.frame_b,
                flat=planar,
            )
            for loop in mechanism.loops
        ]
        for spring in mechanism.springs:
            ends = ((spring.body_a, spring.position_a), (spring.body_b, spring.position_b))
            markers = [self._marker(*end, np.eye(3)) for end in ends]
            self._system.AddObject(
                items.ObjectConnectorSpringDamper(
                    markerNumbers=markers,
                    stiffness=spring.stiffness,
                    damping=spring.damping,
                    referenceLength=spring.length,
                )
            )
        self._system.Assemble()
        self._rows = self._constraint_rows(settings)
        self._rank = independent(self._rows)
        self.integration = Integration(self._system, settings, dependent=self._rank < len(self._rows))

    def _add_bodies(self) -> None:
        system, motion = self._system, Tree(self._mechanism).at(*self._mechanism.start())
        for number, body in enumerate(self._mechanism.bodies):
            R, w = motion.R_WB[number], motion.w_WB[number]
            arm, q = R @ self._com[body.name], to_quaternion(R)
            node = system.AddNode(
                items.NodeRigidBodyEP(
                    referenceCoordinates=[*(motion.p_WB[number] + arm), *q],
                    initialVelocities=[*(motion.v_WB[number] + np.cross(w, arm)), *quaternion_rate(q, R.T @ w)],
                )
            )
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia
            made = system.AddObject(
                items.ObjectRigidBody(mass=body.mass, inertia=[xx, yy, zz, yz, xz, xy], nodeNumber=node)
            )
            self._bodies[body.name] = made
            marker = system.AddMarker(items.MarkerBodyMass(bodyNumber=made))
            system.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=self._mechanism.gravity))

    def _marker(self, body: str, position: Any, axes: Array) -> Any:
        """A marker on a body, at a place in its frame and with the axes of a joint."""
        place = exu.HT(rotation=axes, translation=np.array(position) - self._com[body])
        return self._system.AddMarker(items.MarkerBodyRigid(bodyNumber=self._bodies[body], localHT=place))

    def _join(
        self, item: Joint | Loop, a: str, b: str, at_a: Any, at_b: Any, A: Array, B: Array, *, flat: bool
    ) -> _Made:
        if item.kind == "universal":  # Exudyn's row is x of the first to z of the second, ours z to x
            A, B = A[:, [2, 0, 1]], B[:, [1, 2, 0]]
        markers = [self._marker(a, at_a, A), self._marker(b, at_b, B)]
        constraint, rows = None, _ROWS.get(item.kind, ())
        if item.kind == "spherical":
            constraint = self._system.AddObject(items.ObjectJointSpherical(markerNumbers=markers))
        elif item.kind == "revolute" and not flat:
            constraint = self._system.AddObject(items.ObjectJointRevoluteZ(markerNumbers=markers))
        elif item.kind == "revolute":
            constraint = self._system.AddObject(
                items.ObjectJointGeneric(constrainedAxes=_IN_PLANE, markerNumbers=markers)
            )
            rows = ()
        elif item.kind != "free":
            held = _HELD[item.kind]
            constraint = self._system.AddObject(items.ObjectJointGeneric(constrainedAxes=held, markerNumbers=markers))
        spring = self._spring_of(item, markers) if isinstance(item, Joint) else None
        return _Made(item.kind, constraint, spring, markers, (a, b), (A, B), rows)

    def _spring_of(self, joint: Joint, markers: list[Any]) -> Any:
        """Exudyn's object for the joint's own spring, damper and drive, or None."""
        if not (joint.stiffness or joint.damping or joint.torque):
            return None
        law = {"stiffness": joint.stiffness, "damping": joint.damping, "offset": joint.rest}
        if joint.kind == "spherical":
            D = np.diag([0.0, 0.0, 0.0, *[joint.damping] * 3])
            made = items.ObjectConnectorRigidBodySpringDamper(damping=D, markerNumbers=markers)
        elif joint.kind == "prismatic":  # its force is a pull, as the spring's is
            made = items.ObjectConnectorLinearSpringDamper(
                markerNumbers=markers, force=-joint.torque, axisMarker0=[0.0, 0.0, 1.0], **law
            )
        else:  # its torque acts against the angle, as the spring's does; the node counts whole turns
            turns = items.NodeGenericData(initialCoordinates=[joint.q0[0]], numberOfDataCoordinates=1)
            node = self._system.AddNode(turns)
            made = items.ObjectConnectorTorsionalSpringDamper(
                nodeNumber=node, torque=-joint.torque, **law, markerNumbers=markers
            )
        return self._system.AddObject(made)

    def _constraint_rows(self, settings: ExudynSettings) -> Array:
        """Rows of all constraints on Exudyn's velocities; free axes have none."""
        mass, jacobian, _ = initial_matrices(self._system, settings, dependent=True)
        rows = jacobian[len(mass) :, : len(mass)]
        return np.asarray(rows[np.abs(rows).max(axis=1, initial=0.0) > 0])

    def _body(self, name: str, output: Any, at: Array) -> Array:
        found = self._system.GetObjectOutputBody(self._bodies[name], output, at, exu.ConfigurationType.Current)
        return np.array(found)

    def _over_bodies(self, output: Any) -> Array:
        """A quantity of the origins of all bodies' frames."""
        return np.array([self._body(body.name, output, -self._com[body.name]) for body in self._mechanism.bodies])

    def sample(self) -> Sample:
        """See :class:`proofroll.core.engine.Engine`."""
        force, torque = unsaid(self._mechanism)
        for number, made in enumerate(self._joints):
            force[number], torque[number] = self._reaction(made)
        return Sample(
            p_WB=self._over_bodies(Output.Position),
            v_WB=self._over_bodies(Output.Velocity),
            w_WB=self._over_bodies(Output.AngularVelocity),
            q_WB=np.array([to_quaternion(R.reshape(3, 3)) for R in self._over_bodies(Output.RotationMatrix)]),
            joint_force=force,
            joint_torque=torque,
        )

    def _axes(self, made: _Made) -> tuple[Array, Array]:
        """The frames of a joint in the world."""
        R_a, R_b = (
            np.eye(3) if body == WORLD else self._body(body, Output.RotationMatrix, np.zeros(3)).reshape(3, 3)
            for body in made.bodies
        )
        return R_a @ made.frames[0], R_b @ made.frames[1]

    def _reaction(self, made: _Made) -> tuple[Array, Array]:
        """Force and moment on the second body at its marker."""
        system, (A, B) = self._system, self._axes(made)
        force, torque = np.zeros(3), np.zeros(3)
        if made.kind == "spherical":
            force -= system.GetObjectOutput(made.constraint, Output.Force)
        elif made.constraint is not None:
            force -= A @ system.GetObjectOutput(made.constraint, Output.ForceLocal)
            multipliers = system.GetObjectOutput(made.constraint, Output.TorqueLocal)
            for multiplier, row in zip(multipliers, made.rows, strict=False):  # there are always three
                if row is not None:
                    torque -= multiplier * cross(B[:, row[1]], A[:, row[0]])
        if made.spring is not None and made.kind == "prismatic":
            force -= np.ravel(system.GetObjectOutput(made.spring, Output.ForceLocal))[0] * A[:, 2]
        elif made.spring is not None and made.kind == "revolute":
            torque -= np.ravel(system.GetObjectOutput(made.spring, Output.TorqueLocal))[0] * A[:, 2]
        elif made.spring is not None:
            torque -= A @ system.GetObjectOutput(made.spring, Output.TorqueLocal)
        return force, torque

    def events(self) -> Sequence[Any]:
        """None: nothing here switches."""
        return ()

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        system, bodies = self._system, self._mechanism.bodies
        data = [system.GetObject(self._bodies[body.name]) for body in bodies]
        joints = self._joints[: len(self._mechanism.joints)]
        axes = np.full((len(joints), 3), np.nan)
        for number, (joint, made) in enumerate(zip(self._mechanism.joints, joints, strict=True)):
            if joint.kind in WITH_AXIS:
                axes[number] = self._axes(made)[0][:, 0 if joint.kind == "universal" else 2]
        to_com = np.array(
            [
                self._body(body.name, Output.RotationMatrix, np.zeros(3)).reshape(3, 3).T
                @ (self._body(body.name, Output.Position, np.zeros(3)) - p)
                for body, p in zip(bodies, self._over_bodies(Output.Position), strict=True)
            ]
        )
        loads = [system.GetLoad(number) for number in range(system.systemData.NumberOfLoads())]
        return MechanismBuilt(
            mass=np.array([item["mass"] for item in data]),
            com=to_com + np.array([item["centerOfMass"] for item in data]),
            inertia=np.array([_matrix(item["inertia"]) for item in data]),
            joint_position=np.array(
                [
                    system.GetMarkerOutput(made.markers[1], Output.Position, exu.ConfigurationType.Current)
                    for made in joints
                ]
            ),
            joint_axis=axes,
            gravity=np.array(loads[0]["loadVector"]) if loads else np.zeros(3),
            rows=len(self._rows),
            rank=self._rank,
            mobility=self._rows.shape[1] - self._rank,
            acceleration=self._over_bodies(Output.Acceleration),
            angular_acceleration=self._over_bodies(Output.AngularAcceleration),
            regularised=dict.fromkeys(("acceleration", "angular_acceleration"), _DIFFERENCED),
        )


def _matrix(six: Any) -> Array:
    xx, yy, zz, yz, xz, xy = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _check(mechanism: Mechanism) -> None:
    """What the capabilities do not say.

    Raises:
        Refused: a body without mass, or a spring in a universal joint.
    """
    for body in mechanism.bodies:
        if not body.mass:
            raise Refused(f"{body.name} has no mass; in redundant coordinates each body needs one")
    for joint in mechanism.joints:
        if joint.kind == "universal" and (joint.stiffness or joint.damping):
            raise Refused(f"Exudyn has no torsional spring or damper for the two angles of {joint.name}")
