"""Geometry of all contacts of a tree, and the rows of their slides, at a state in floats or symbols."""

from collections.abc import Mapping

import numpy as np

from proofroll.core.arrays import cross
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.joint_laws import JointContact, joint_contacts
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction, turning_frictions
from proofroll.elements.mechanism.contact.touching import AT_REST, Moving, Touching, touch
from proofroll.elements.mechanism.dynamics.switches import switched_joints
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.engines.projection.smooth.connections import Bodies
from proofroll.engines.projection.smooth.dependent import DependentCoordinates, SolvedState


class ContactGeometry:
    """Contacts of bodies, laws of joints, and friction against turning, in this order.

    Attributes:
        contacts: all of them; ``bodies``, ``joints`` and ``turning`` are the three kinds.
        friction: their coefficients.
    """

    def __init__(self, equations: DependentCoordinates, mechanism: Mechanism) -> None:
        self._equations, self._index = equations, mechanism.body_index
        self.bodies, self.joints = mechanism.contacts, joint_contacts(switched_joints(mechanism))
        self.turning = turning_frictions(self.bodies)
        self.contacts: tuple[BodyContact | JointContact | TurningFriction, ...] = (
            *self.bodies,
            *self.joints,
            *self.turning,
        )
        self.friction = np.array([contact.friction for contact in self.contacts])

    def at(self, x: Array, free: SolvedState, S: Array) -> tuple[tuple[Touching, ...], Array, Array]:
        """Geometry, derivatives of sliding velocities by ν, (contacts, 3, nv), and their rates, (contacts, 3).

        Args:
            x: the state.
            free: equations of motion solved there without contact forces.
            S: twists of unit velocities, (nv, 4, 4).
        """
        moving, moves = self.moving(x, free.bodies), self._equations.tree.moves
        touching = self.touching(x, moving)
        J, rate = np.zeros((len(touching), 3, len(S)), dtype=x.dtype), np.zeros((len(touching), 3), dtype=x.dtype)
        for k, (contact, point) in enumerate(zip(self.bodies, touching, strict=False)):
            lever = S[:, :3, :3] @ (point.place - free.bodies.origin) + S[:, :3, 3]
            for body, sign in ((contact.body_a, 1.0), (contact.body_b, -1.0)):
                i = self._index[body]
                if i >= 0:
                    J[k] += sign * (moves[i][:, None] * lever).T
                    rate[k] += sign * self._material(x, free, i, moving[body], point)
        for k, switch in enumerate(self.joints, len(self.bodies)):
            J[k, :, switch.joint.velocity] = switch.direction
            rate[k] = switch.direction * free.rates[switch.joint.velocity]
        sizes = [] if x.dtype == object else [float(np.linalg.norm(body.w)) for body in moving.values()]
        fastest = max(sizes, default=0.0)
        for k, friction in enumerate(self.turning, len(self.bodies) + len(self.joints)):
            contact, point = self.bodies[friction.pressed_by], touching[friction.pressed_by]
            spin, spin_rate = np.zeros_like(J[0]), np.zeros_like(rate[0])
            for body, sign in ((contact.body_a, 1.0), (contact.body_b, -1.0)):
                i = self._index[body]
                if i >= 0:
                    axes = S[:, [2, 0, 1], [1, 2, 0]]  # of the velocities, from their matrices
                    spin += sign * (moves[i][:, None] * axes).T
                    spin_rate += sign * moving[body].R @ free.angular[i]
            J[k] = friction.resisted(point.normal, spin)
            relative = moving[contact.body_a].w - moving[contact.body_b].w
            rate[k] = friction.resisted_rate(point, relative, spin_rate, fastest)
        return touching, J, rate

    def touching(self, x: Array, moving: Mapping[str, Moving]) -> tuple[Touching, ...]:
        """Gap, normal and sliding velocity of each contact."""
        joints = self._equations.watched(x) if self.joints else {}
        pairs = [(moving[contact.body_a], moving[contact.body_b]) for contact in self.bodies]
        bodies = [touch(contact, a, b) for contact, (a, b) in zip(self.bodies, pairs, strict=True)]
        turns = [(friction, friction.pressed_by) for friction in self.turning]
        return (
            *bodies,
            *(contact.touching(*joints[contact.joint.number]) for contact in self.joints),
            *(friction.touching(bodies[k], pairs[k][0].w - pairs[k][1].w) for friction, k in turns),
        )

    def moving(self, x: Array, bodies: Bodies) -> dict[str, Moving]:
        """Motion of the frames of all bodies, and of the world."""
        equations = self._equations
        r, _, v, _ = equations.parts(x)
        moving = {"world": AT_REST}
        for name, i in self._index.items():
            if i >= 0:
                R, w = bodies.rotation[i], bodies.spin[i]
                arm = R @ equations.com[i]
                moving[name] = Moving(r[i] - arm, R, v[i] - cross(w, arm), w)
        return moving

    def _material(self, x: Array, free: SolvedState, i: int, body: Moving, point: Touching) -> Array:
        """Rate of the velocity of a body's material at the contact point, which moves over the body."""
        arm = point.place - self._equations.parts(x)[0][i]
        turning = cross(body.R @ free.angular[i], arm) + cross(body.w, cross(body.w, arm))
        return np.asarray(free.linear[i] + turning + cross(body.w, point.place_rate - body.velocity(point.place)))
