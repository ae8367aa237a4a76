"""Joints and loops between rigid bodies as Exudyn's constraints and connectors, and their reactions.

Each has two markers with the axes of the joint's own frames; Exudyn gives reactions in the axes of the first.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import WORLD, Force, Joint, Mechanism, Spring
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, JointKind
from proofroll.elements.mechanism.scene.model import JointOrLoop
from proofroll.elements.mechanism.scene.rotations import Array, cross, frame_of_axis
from proofroll.elements.mechanism.scene.signal import varies
from proofroll.engines.exudyn.native import Output, data_node, exu, items

# 1 for each of three translations and three rotations that Exudyn's joint locks, in the axes of its first frame.
_HELD: Mapping[str, tuple[int, ...]] = {
    JointKind.FIXED: (1, 1, 1, 1, 1, 1),
    JointKind.PRISMATIC: (1, 1, 0, 1, 1, 1),
    JointKind.CYLINDRICAL: (1, 1, 0, 1, 1, 0),
    JointKind.UNIVERSAL: (1, 1, 1, 0, 1, 0),
    JointKind.PLANAR: (0, 0, 1, 1, 1, 0),
}
# The same for a loop of a planar mechanism that turns: the plane locks the rest already.
_IN_PLANE = (1, 1, 0, 0, 0, 0)
_TURNS = frozenset({JointKind.REVOLUTE, JointKind.CYLINDRICAL, JointKind.SPHERICAL})
# The two axes, one of each frame, that each rotational row keeps perpendicular. Components of ``TorqueLocal`` are the
# multipliers of these rows, not a moment. Found from residuals of the rows; Exudyn's documents do not describe it.
_THREE, _TWO = ((2, 1), (2, 0), (0, 1)), ((2, 0), (2, 1))
_ROWS: Mapping[str, tuple[tuple[int, int] | None, ...]] = {
    JointKind.FIXED: _THREE,
    JointKind.PRISMATIC: _THREE,
    JointKind.REVOLUTE: _TWO,
    JointKind.CYLINDRICAL: _TWO,
    JointKind.PLANAR: _TWO,
    JointKind.UNIVERSAL: (None, (0, 2)),
}


class Connected(NamedTuple):
    """A joint or loop in Exudyn.

    Attributes:
        between: the joint or loop, with its frames as Exudyn has them: for a universal joint the axes are permuted.
        constraint, spring: Exudyn's objects; None where there is none.
        markers: Exudyn's markers on both bodies.
        rows: perpendicular axes of these frames, see ``_ROWS``.
    """

    between: JointOrLoop
    constraint: Any
    spring: Any
    markers: list[Any]
    rows: tuple[tuple[int, int] | None, ...]


def add_springs(system: Any, mechanism: Mechanism, marker: Callable[[str, Any], Any]) -> None:
    """Adds the springs between points; ``marker`` makes Exudyn's marker at a place in a body's frame."""
    for spring in mechanism.springs:
        ends = ((spring.body_a, spring.position_a), (spring.body_b, spring.position_b))
        system.AddObject(
            items.ObjectConnectorSpringDamper(
                markerNumbers=[marker(*end) for end in ends],
                stiffness=spring.stiffness,
                damping=spring.damping,
                referenceLength=spring.length,
                **({} if spring.force is None else {"springForceUserFunction": _pull_of(spring)}),
            )
        )


def _pull_of(spring: Spring) -> Callable[..., float]:
    """Pull of a spring as Exudyn's function of its elongation and the rate of this."""

    def pull(system: Any, t: float, item: int, longer: float, rate: float, *law: float) -> float:  # noqa: ARG001 -- Exudyn's signature
        return float(spring.pull(longer + spring.length, rate))

    return pull


def add_forces(
    system: Any, mechanism: Mechanism, marker: Callable[[str, Any], Any], turns: Mapping[str, Array] | None = None
) -> None:
    """Adds applied forces and moments.

    Args:
        system: Exudyn's system.
        mechanism: with the forces.
        marker: makes Exudyn's marker at a place in a body's frame.
        turns: body name -> rotation from the body's axes to its marker's; None: they are the same.

    Raises:
        Refused: a force has a reaction on a body: this adapter has loads at places that do not move in their body.
    """
    for applied in mechanism.forces:
        if applied.reaction != WORLD and (applied.kind == "force" or applied.frame == "body"):
            advice = "Exudyn's loads act on one body; one that follows another body is not built in this adapter"
            raise Refused(f"{applied.name} presses back on {applied.reaction}: {advice}")
        load = items.LoadForceVector if applied.kind == "force" else items.LoadTorqueVector
        follows = applied.frame == "body"
        turn = np.eye(3) if turns is None or not follows else turns[applied.body]
        moving = any(map(varies, applied.value))
        for body, sign in ((applied.body, 1.0), (applied.reaction, -1.0)):
            if body == WORLD:
                continue
            varying = {"loadVectorUserFunction": _values_of(applied, sign * turn)} if moving else {}
            system.AddLoad(
                load(
                    markerNumber=marker(body, applied.position),
                    loadVector=[float(value) for value in sign * turn @ applied.at(0.0)],
                    bodyFixed=follows,
                    **varying,
                )
            )


def _values_of(applied: Force, turn: Array) -> Callable[..., list[float]]:
    """Components of a force, turned, as Exudyn's function of time."""

    def values(system: Any, t: float, vector: list[float]) -> list[float]:  # noqa: ARG001 -- Exudyn's signature
        return [float(value) for value in turn @ applied.at(t)]

    return values


class Connections:
    """Adds joints and loops between bodies of a system, and reads their reactions.

    Args:
        system: Exudyn's system.
        bodies: body name -> Exudyn's number of it; the world is one of them.
        com: body name -> Exudyn's reference point, the centre of mass, in our body frame [m].
        turns: body name -> rotation from our body axes to Exudyn's.
    """

    def __init__(
        self, system: Any, bodies: Mapping[str, Any], com: Mapping[str, Array], turns: Mapping[str, Array]
    ) -> None:
        self._system, self._bodies, self._com, self._turns = system, bodies, com, turns

    def marker(self, body: str, position: Any, axes: Array) -> Any:
        """A marker on a body, at a place in its frame and with the axes of a joint."""
        place = exu.HT(rotation=self._turns[body] @ axes, translation=self._local(body, position))
        return self._system.AddMarker(items.MarkerBodyRigid(bodyNumber=self._bodies[body], localHT=place))

    def _local(self, body: str, position: Any) -> Array:
        return np.asarray(self._turns[body] @ (np.array(position) - self._com[body]))

    def coordinate(self, joint: Joint) -> Any:
        """Marker of a joint's coordinate; an angle is zero where the axes of both bodies in Exudyn are parallel."""
        between: dict[str, Any] = {
            "bodyNumbers": [self._bodies[joint.parent], self._bodies[joint.child]],
            "localPosition0": self._local(joint.parent, joint.position),
            "localPosition1": self._local(joint.child, joint.child_position),
            "axis0": self._turns[joint.parent] @ joint.parent_frame[:, 2],
        }
        if joint.kind == JointKind.PRISMATIC:
            return self._system.AddMarker(items.MarkerBodiesRelativeTranslationCoordinate(**between))
        node = data_node(self._system, joint.q0[0])  # it counts whole turns
        return self._system.AddMarker(items.MarkerBodiesRelativeRotationCoordinate(nodeNumber=node, **between))

    def connect(self, between: JointOrLoop, joint: Joint | None, normals: Mapping[str, Array]) -> Connected:
        """Adds a joint with its own spring, damper and drive, or a loop, whose ``joint`` is None.

        ``normals``: of a planar mechanism, body name -> normal of the plane in the body's frame; else empty.
        """
        flat = bool(normals) and joint is None and between.kind in _TURNS
        if flat and between.kind == JointKind.SPHERICAL:  # it has no axis of its own: in a plane it turns as a hinge
            A, B = (frame_of_axis(normals[body]) for body in (between.a, between.b))
            between = between._replace(kind=JointKind.REVOLUTE, frame_a=A, frame_b=B)
        kind, A, B = between.kind, between.frame_a, between.frame_b
        if kind == JointKind.UNIVERSAL:  # Exudyn's row is x of the first to z of the second, ours z to x
            A, B = A[:, [2, 0, 1]], B[:, [1, 2, 0]]
        markers = [self.marker(between.a, between.position_a, A), self.marker(between.b, between.position_b, B)]
        item, rows = None, _ROWS.get(kind, ())
        if flat:
            item, rows = items.ObjectJointGeneric(constrainedAxes=_IN_PLANE, markerNumbers=markers), ()
        elif kind == JointKind.SPHERICAL:
            item = items.ObjectJointSpherical(markerNumbers=markers)
        elif kind == JointKind.REVOLUTE:
            item = items.ObjectJointRevoluteZ(markerNumbers=markers)
        elif kind == DISTANCE:
            item = items.ObjectConnectorDistance(markerNumbers=markers, distance=between.length)
        elif kind != JointKind.FREE:
            item = items.ObjectJointGeneric(constrainedAxes=_HELD[kind], markerNumbers=markers)
        constraint = None if item is None else self._system.AddObject(item)
        spring = None if joint is None else self._spring_of(joint, markers)
        return Connected(
            between=between._replace(frame_a=A, frame_b=B),
            constraint=constraint,
            spring=spring,
            markers=markers,
            rows=rows,
        )

    def _spring_of(self, joint: Joint, markers: list[Any]) -> Any:
        """Exudyn's object for the joint's own spring, damper and drive, or None."""
        if not (joint.stiffness or joint.damping or joint.torque):
            return None
        law = {"stiffness": joint.stiffness, "damping": joint.damping, "offset": joint.rest}
        if joint.kind == JointKind.SPHERICAL:
            D = np.diag([0.0, 0.0, 0.0, *[joint.damping] * 3])
            item = items.ObjectConnectorRigidBodySpringDamper(damping=D, markerNumbers=markers)
        elif joint.kind == JointKind.PRISMATIC:  # its force is a pull, as the spring's is
            item = items.ObjectConnectorLinearSpringDamper(
                markerNumbers=markers, force=-joint.constant_drive, axisMarker0=[0.0, 0.0, 1.0], **law
            )
        else:  # its torque acts against the angle, as the spring's does; the node counts whole turns
            node = data_node(self._system, joint.q0[0])
            item = items.ObjectConnectorTorsionalSpringDamper(
                nodeNumber=node, torque=-joint.constant_drive, **law, markerNumbers=markers
            )
        return self._system.AddObject(item)

    def axes(self, made: Connected) -> tuple[Array, Array]:
        """World axes of both frames of a joint, as columns, shape (3, 3) each."""
        R_a, R_b = (
            np.eye(3) if body == WORLD else self.body(body, Output.RotationMatrix, np.zeros(3)).reshape(3, 3)
            for body in (made.between.a, made.between.b)
        )
        return R_a @ made.between.frame_a, R_b @ made.between.frame_b

    def reaction(self, made: Connected) -> tuple[Array, Array]:
        """Force [N] and moment [N m] of a joint or loop on the second body at its marker, world axes."""
        system, (A, B) = self._system, self.axes(made)
        force, torque = np.zeros(3), np.zeros(3)
        if made.between.kind == DISTANCE:  # a pull
            now = exu.ConfigurationType.Current
            a, b = (np.array(system.GetMarkerOutput(marker, Output.Position, now)) for marker in made.markers)
            pull = float(np.ravel(system.GetObjectOutput(made.constraint, Output.Force))[0])
            force -= pull * (b - a) / made.between.length
        elif made.between.kind == JointKind.SPHERICAL:
            force -= system.GetObjectOutput(made.constraint, Output.Force)
        elif made.constraint is not None:
            force -= A @ system.GetObjectOutput(made.constraint, Output.ForceLocal)
            multipliers = system.GetObjectOutput(made.constraint, Output.TorqueLocal)
            for multiplier, row in zip(multipliers, made.rows, strict=False):  # there are always three
                if row is not None:
                    torque -= multiplier * cross(B[:, row[1]], A[:, row[0]])
        if made.spring is not None and made.between.kind == JointKind.PRISMATIC:
            force -= np.ravel(system.GetObjectOutput(made.spring, Output.ForceLocal))[0] * A[:, 2]
        elif made.spring is not None and made.between.kind == JointKind.REVOLUTE:
            torque -= np.ravel(system.GetObjectOutput(made.spring, Output.TorqueLocal))[0] * A[:, 2]
        elif made.spring is not None:
            torque -= A @ system.GetObjectOutput(made.spring, Output.TorqueLocal)
        return force, torque

    def body(self, name: str, output: Any, place: Array) -> Array:
        """Exudyn's output variable of a body at a place relative to its centre of mass [m], our body axes."""
        turn, now = self._turns[name], exu.ConfigurationType.Current
        quantity = np.array(self._system.GetObjectOutputBody(self._bodies[name], output, turn @ place, now))
        return (quantity.reshape(3, 3) @ turn).ravel() if output == Output.RotationMatrix else quantity
