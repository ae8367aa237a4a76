"""What is read back from the formulation ``contact``: state, reactions, and what was built."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from proofroll.core.engine import Built, Sample
from proofroll.core.events import Event
from proofroll.elements.ball_on_surface.model import BallCapability, RollingBall
from proofroll.engines.pinocchio.contact import UNBOUNDED_FRICTION, ContactSteps
from proofroll.engines.pinocchio.contact_tolerances import softened
from proofroll.engines.pinocchio.settings import PinocchioSettings

# Numbers of a joint's configuration if it is an orientation.
_QUATERNION = 4


class ContactRun(ContactSteps):
    """See :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, body: RollingBall, settings: PinocchioSettings) -> None:
        super().__init__(body, settings)
        self._body = body
        self._looked_at = self.contact.model.createData()  # for sampling, which leaves the running data alone
        self._unbounded = UNBOUNDED_FRICTION[self.solver]

    def sample(self) -> Sample:
        """See :class:`proofroll.core.engine.Engine`; the force is that of the step beginning or centred here."""
        contact, kick, data = self.contact, self.kick(), self._looked_at
        # The velocity runs ahead by half a step with leapfrog, once it has begun to run.
        v = 0.5 * (self.v + kick.v) if self.leapfrog and self.started else self.v
        pin.forwardKinematics(contact.model, data, self.q, v)
        velocity = pin.getVelocity(contact.model, data, contact.ball, pin.LOCAL_WORLD_ALIGNED)
        pose = data.oMi[contact.ball]
        return Sample(
            p_WB=pose.translation.copy(),
            v_WB=velocity.linear.copy(),
            w_WB=velocity.angular.copy(),
            q_WB=np.roll(pin.Quaternion(pose.rotation).coeffs(), 1),
            force=contact.axes @ kick.impulse / self.span,
            sticking=kick.status == "stick" if self.bounded else None,
        )

    def built(self) -> Built:
        """See :class:`proofroll.core.engine.Engine`; from the model, its contact and its torques now."""
        contact, kick = self.contact, self.kick()
        inertia, point, pose = contact.model.inertias[contact.ball], contact.point, contact.data.oMi[contact.ball]
        # At rest the resistance has no direction, so its lever is looked at in motion.
        triad = self._body.surface.triad(*pose.translation.tolist())
        lever = float(np.linalg.norm(self.resistance(triad, triad[3:6], 1.0)))
        acceleration = (kick.v - self.v) / self.span
        return Built(
            mass=float(inertia.mass),
            inertia=np.linalg.eigvalsh(inertia.inertia),
            gravity=contact.model.gravity.linear.copy(),
            ball_radius=float(np.linalg.norm(point.joint2_placement.translation)),
            rolling_resistance=lever,
            mu_static=contact.friction(self.mu_static),
            mu_kinetic=contact.friction(self.mu_kinetic),
            # The plane is posed at the contact; how far the wall is from there, the solver is told besides.
            gap=float(contact.point_data.c1Mc2.translation[2] + self._body.surface.gap(pose.translation)),
            acceleration=acceleration[:3],
            angular_acceleration=pose.rotation @ acceleration[3:],
            regularised=softened(
                self._body,
                bends=self.leapfrog,
                dt=self.dt,
                impulse=0.0 if self.solver == "pgs" else self.tolerance,
                unbounded=None if self.bounded else self._unbounded,
            ),
            terms=frozenset(self._terms(lever)),
        )

    def _terms(self, lever: float) -> Iterator[BallCapability]:
        """What there is besides rolling: the torque's lever [m], the cone, and a joint that turns the ball."""
        contact = self.contact
        if lever:
            yield BallCapability.ROLLING_RESISTANCE
        if contact.friction(self.mu_static) != self._unbounded:
            yield BallCapability.BOUNDED_FRICTION
        if contact.model.joints[contact.ball].nq == _QUATERNION:
            yield BallCapability.ORIENTATION

    def events(self) -> tuple[Event, ...]:
        """See :class:`proofroll.core.engine_abilities.LocatesEvents`; none with unbounded friction."""
        return tuple(self.happened) if self.bounded else ()
