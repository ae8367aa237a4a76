"""Formulation ``discs``: bodies of :mod:`redundant` whose circles roll on planes by ``ObjectJointRollingDisc``.

The joint holds the velocity of a disc's material at its lowest point at zero, along the plane and across it: a circle
that never slips (``friction = inf``) while it presses. Where the true contact would open, the joint pulls.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
from typing_extensions import override

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import WORLD, Mechanism
from proofroll.elements.mechanism.contact.start import extent, touches
from proofroll.elements.mechanism.run.capabilities import ALL_SHAPES, MechanismCapability
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample
from proofroll.elements.mechanism.scene.rotations import Array, cross
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import CircleShape, HalfSpace
from proofroll.engines.exudyn.native import Output, exu, items
from proofroll.engines.exudyn.settings import ExudynSettings
from proofroll.engines.exudyn.smooth import redundant
from proofroll.engines.exudyn.smooth.redundant import Redundant

_CAPABILITY = MechanismCapability
_TOUCH = {_CAPABILITY.DISCS, _CAPABILITY.PLANES}
PROVIDES = redundant.PROVIDES | _TOUCH | {_CAPABILITY.CONTACT, _CAPABILITY.UNBOUNDED_FRICTION}
_HELD = "its joint holds a disc on its plane"
_STICKS = "its joint never slips (friction = inf)"
LACKING: Mapping[str, str] = {
    **redundant.LACKING,
    **dict.fromkeys(ALL_SHAPES - _TOUCH, "Exudyn's joint rolls discs on planes"),
    _CAPABILITY.CONTACT_FRICTION: _STICKS,
    _CAPABILITY.CONTACT_REBOUNDS: _HELD,
    _CAPABILITY.SLIP_REBOUNDS: _HELD,
    _CAPABILITY.STATIC_FRICTION: _STICKS,
    _CAPABILITY.TURNING_FRICTION: "its joint has no moment",
}
# Gap at the start, relative to the mechanism's extent, up to which a disc touches: digits of a file.
_TOUCHES = 1e-9


class _Made(NamedTuple):
    """One disc in Exudyn: its joint, the body and the circle, and the sign of the joint's force on body a."""

    item: Any
    body: str
    circle: CircleShape
    sign: float


class Discs(Redundant):
    """Run with circles that roll on planes; see :class:`proofroll.core.engine.Engine` for the methods."""

    provides: ClassVar[frozenset[str]] = PROVIDES
    lacking: ClassVar[Mapping[str, str]] = LACKING

    def _add_contacts(self, mechanism: Mechanism, settings: ExudynSettings) -> None:  # noqa: ARG002 -- softness alone needs settings
        motion = self._at_start
        size = extent(mechanism, motion) if mechanism.contacts else 0.0
        self._discs: list[_Made] = []
        for contact, state in zip(mechanism.contacts, touches(mechanism, motion), strict=True):
            made = self._add_disc(contact)
            if state.gap > _TOUCHES * size:
                raise Refused(f"{contact.name} starts {state.gap:g} m above its plane, and {_HELD} from the start")
            self._discs.append(made)

    def _turning(self) -> Mapping[Any, Array] | None:
        """See :class:`.Redundant`.

        With v of the centre of mass and a from there to the contact, d/dt (v + ω × a) = v̇ + ω̇ × a + ω × ȧ.
        """
        mechanism, motion, turning = self._mechanism, self._at_start, {}
        for made, state in zip(self._discs, touches(mechanism, motion), strict=True):
            k = mechanism.body_index[made.body]
            w = motion.w_WB[k]
            arm_rate = state.place_rate - motion.v_WB[k] - cross(w, motion.R_WB[k] @ self._com[made.body])
            turning[made.item] = -self._directions(made).T @ cross(w, arm_rate)
        return turning or None

    def _add_disc(self, contact: BodyContact) -> _Made:
        """Adds the joint of a contact. Raises Refused for what is no circle without slip on a plane at rest."""
        sides = [(contact.body_a, contact.shape_a), (contact.body_b, contact.shape_b)]
        sign = 1.0
        if isinstance(contact.shape_a, HalfSpace):
            sides, sign = sides[::-1], -1.0
        (body, circle), (ground, plane) = sides
        assert isinstance(circle, CircleShape)
        assert isinstance(plane, HalfSpace)
        if not np.isinf(contact.friction):
            raise Refused(f"{contact.name} has no friction, and {_STICKS}")
        if ground != WORLD:
            raise Refused(f"the plane of {contact.name} is on {ground}; this adapter rolls discs on the world's planes")
        item = items.ObjectJointRollingDisc(
            markerNumbers=[self.marker(ground, plane.point), self.marker(body, circle.centre)],
            discRadius=circle.radius,
            discAxis=circle.normal,
            planeNormal=plane.normal,
        )
        return _Made(self.system.AddObject(item), body, circle, sign)

    def _contact_rows(self) -> Sequence[int]:
        data = self.system.systemData
        return [row for made in self._discs for row in data.GetObjectLTGAE(made.item)]

    def _directions(self, made: _Made) -> Array:
        """Lateral, longitudinal and normal direction of a joint in the world, as columns."""
        return np.reshape(self.system.GetObjectOutput(made.item, Output.RotationMatrix), (3, 3))

    @override
    def sample(self) -> MechanismSample:
        force = [
            made.sign * self._directions(made) @ self.system.GetObjectOutput(made.item, Output.ForceLocal)
            for made in self._discs
        ]
        return replace(super().sample(), contact_force=np.reshape(force, (len(force), 3)))

    @override
    def built(self) -> MechanismBuilt:
        model = super().built()
        if not self._discs:
            return model
        gaps, normals, places = zip(*map(self._lying, self._discs), strict=True)
        return replace(
            model,
            contact_gap=np.array(gaps),
            contact_normal=np.array(normals),
            contact_place=np.array(places),
            contact_friction=np.full(len(gaps), np.inf),
            contact_restitution=np.zeros(len(gaps)),
        )

    def _lying(self, made: _Made) -> tuple[float, Array, Array]:
        """Gap [m], normal from b to a, and place [m] of a contact, read from Exudyn's joint."""
        item, kind = self.system.GetObject(made.item), exu.ConfigurationType.Current
        plane, centre = (np.array(self.system.GetMarkerOutput(k, Output.Position, kind)) for k in item["markerNumbers"])
        normal, place = self._directions(made)[:, 2], np.array(self.system.GetObjectOutput(made.item, Output.Position))
        axis = np.reshape(
            self.system.GetMarkerOutput(item["markerNumbers"][1], Output.RotationMatrix, kind), (3, 3)
        ) @ np.array(item["discAxis"])
        height = item["discRadius"] * np.linalg.norm(cross(axis, normal))
        return float(normal @ (centre - plane) - height), made.sign * normal, place
