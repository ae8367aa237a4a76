"""What is read back from the formulation ``contact``: state, reactions, and what was built."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import Built, Sample
from proofroll.core.events import Event
from proofroll.elements.ball_on_surface.model import BallCapability, RollingBall
from proofroll.engines.pinocchio.contact import UNBOUNDED_FRICTION, ContactSteps
from proofroll.engines.pinocchio.contact_tolerances import softened
from proofroll.engines.pinocchio.settings import PinocchioSettings

# Numbers of a joint's configuration if it is an orientation.
_QUATERNION = 4


class ContactRun:
    """See :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, body: RollingBall, settings: PinocchioSettings) -> None:
        """At time 0.

        Raises:
            Refused: Pinocchio's solver does not find the first impulse.
        """
        self._body = body
        self.steps = ContactSteps(body, settings)
        self._looked_at = self.steps.contact.model.createData()  # for sampling, which leaves the running data alone
        self._unbounded = UNBOUNDED_FRICTION[self.steps.solver]

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.steps.advance(t)

    def sample(self) -> Sample:
        """See :class:`proofroll.core.engine.Engine`; the force is that of the step beginning or centred here."""
        steps, data = self.steps, self._looked_at
        contact, kick = steps.contact, steps.kick()
        # The velocity runs ahead by half a step with leapfrog, once it has begun to run.
        v = 0.5 * (steps.v + kick.v) if steps.leapfrog and steps.started else steps.v
        pin.forwardKinematics(contact.model, data, steps.q, v)
        velocity = pin.getVelocity(contact.model, data, contact.ball, pin.LOCAL_WORLD_ALIGNED)
        pose = data.oMi[contact.ball]
        return Sample(
            p_WB=pose.translation.copy(),
            v_WB=velocity.linear.copy(),
            w_WB=velocity.angular.copy(),
            q_WB=np.roll(pin.Quaternion(pose.rotation).coeffs(), 1),
            force=contact.axes @ kick.impulse / steps.span,
            sticking=kick.status == "stick" if steps.bounded else None,
        )

    def built(self) -> Built:
        """See :class:`proofroll.core.engine.Engine`; from the model, its contact and its torques now."""
        steps = self.steps
        contact, kick = steps.contact, steps.kick()
        inertia, point, pose = contact.model.inertias[contact.ball], contact.point, contact.data.oMi[contact.ball]
        lever = self._lever(pose)
        acceleration = (kick.v - steps.v) / steps.span
        return Built(
            mass=float(inertia.mass),
            inertia=np.linalg.eigvalsh(inertia.inertia),
            gravity=contact.model.gravity.linear.copy(),
            ball_radius=float(np.linalg.norm(point.joint2_placement.translation)),
            rolling_resistance=lever,
            mu_static=contact.friction(steps.mu_static),
            mu_kinetic=contact.friction(steps.mu_kinetic),
            # The plane is posed at the contact; how far the wall is from there, the solver is told besides.
            gap=float(contact.point_data.c1Mc2.translation[2] + self._body.surface.gap(pose.translation)),
            acceleration=acceleration[:3],
            angular_acceleration=pose.rotation @ acceleration[3:],
            regularised=softened(
                self._body,
                bends=steps.leapfrog,
                dt=steps.dt,
                impulse=0.0 if steps.solver == "pgs" else steps.tolerance,
                unbounded=None if steps.bounded else self._unbounded,
            ),
            terms=frozenset(self._terms(lever)),
        )

    def _lever(self, pose: pin.SE3) -> float:
        """Lever f of rolling resistance [m]; at rest it has no direction, so it is looked at in motion."""
        triad = self._body.surface.triad(*pose.translation.tolist())
        torque: FloatArray = self.steps.resistance(triad, triad[3:6], 1.0)
        return float(np.linalg.norm(torque))

    def _terms(self, lever: float) -> Iterator[BallCapability]:
        """What there is besides rolling: the torque's lever [m], the cone, and a joint that turns the ball."""
        contact = self.steps.contact
        if lever:
            yield BallCapability.ROLLING_RESISTANCE
        if contact.friction(self.steps.mu_static) != self._unbounded:
            yield BallCapability.BOUNDED_FRICTION
        if contact.model.joints[contact.ball].nq == _QUATERNION:
            yield BallCapability.ORIENTATION

    def events(self) -> tuple[Event, ...]:
        """See :class:`proofroll.core.engine_abilities.LocatesEvents`; none with unbounded friction."""
        return tuple(self.steps.events) if self.steps.bounded else ()
