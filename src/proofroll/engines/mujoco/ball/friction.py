"""Bounded friction of a ball: events of stick and slip, switch of the coefficient, correction of the convex cone."""

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from proofroll.core.events import Event, EventKind
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.mechanism.scene.balls import Contact
from proofroll.engines.mujoco.contact.coefficients import NEAR_CONE
from proofroll.engines.mujoco.settings import PRELOAD, MujocoSettings

# Numbers of user data that BoundedFriction.correct keeps: a Jacobian of three rows and MuJoCo's six velocities.
SLIP_MEMORY = 18
# MuJoCo's solver projects a force onto the cone, so the force of a slipping contact lies on it to round-off.
_ON_CONE = 1 - 1e-9


def condim(mu: float, settings: MujocoSettings) -> int:
    """MuJoCo's dimension of a contact: 1 without friction, 3 with sliding friction only, or what the settings say."""
    return settings.condim if mu > 0 else 1


def corrects(contact: Contact, settings: MujocoSettings) -> bool:
    """True if the contact's reference acceleration is edited for slip."""
    return settings.cone_correction and 0 < contact.mu_static < math.inf


class BoundedFriction:
    """Stick, slip and lift-off of the ball's one contact, where friction is bounded.

    MuJoCo has one coefficient. If the kinetic one is less than the static one, it is switched as a user would do it: to
    the kinetic one once the force is on the cone, back once the force is inside it again.

    A contact without a normal force neither sticks nor slips. MuJoCo's cone lifts a slipping ball (:meth:`correct`) in
    hops of up to 0.05 s: 50 steps of 1e-3 s, or 130 of 2.5e-4 s. So distance, not the number of steps, separates hops
    from flights: a hop is a fraction of the radius high. A ball that lands as it took off (sticking or slipping) makes
    no event. One that gets further than its radius from the wall has lifted off: one event, dated at the first step
    without a normal force.

    Attributes:
        sticking: True if the force was inside the cone at the start of the last step with a normal force.
    """

    def __init__(self, model: Any, body: RollingBall, settings: MujocoSettings) -> None:
        self._model = model
        self._static, self._kinetic = body.contact.mu_static, body.contact.mu_kinetic
        self._mu = self._static
        self._pyramidal = settings.cone == "pyramidal"
        self._corrects = corrects(body.contact, settings)
        self._preload = PRELOAD / body.ball.mass
        self._radius = body.ball.radius
        self._surface = body.surface
        self._ball = model.body("ball").id
        last = int(model.joint("spin").dofadr[0]) + (6 if settings.formulation == "free" else 3)
        self._spin = slice(last - 3, last)
        self._stages = settings.integrator == "RK4"
        self._dt = settings.dt
        self._settings = settings
        self._steps = 0
        self._lost: int | None = None  # first step without a normal force since the last one with it
        self._flies = False  # True if a lift-off was recorded for these steps
        self._events: list[Event] = []
        self._wrench = np.zeros(6)
        self._force = self._wrench[:3]
        self.sticking = True

    def start(self, data: Any) -> bool:
        """True if the forces at time 0 hold the ball; if not, records that it slips from time 0."""
        if not self.holds(data):
            self._change(False, Event(EventKind.SLIP, 0.0, 0.0, 0.0))
        return self.sticking

    def step(self, data: Any) -> None:
        """One mj_step; observes the forces at its start, before RK4's further stages replace them."""
        model = self._model
        if not self._stages:
            mujoco.mj_step(model, data)  # the forces are still those of the start
            self.observe(data)
            return
        mujoco.mj_checkPos(model, data)
        mujoco.mj_checkVel(model, data)
        mujoco.mj_forward(model, data)
        mujoco.mj_checkAcc(model, data)
        self.observe(data)
        mujoco.mj_RungeKutta(model, data, 4)

    def observe(self, data: Any) -> None:
        """Records events from the forces at the start of a step; to be called once per step."""
        if not self._presses(data):
            self._miss(data)
        elif self._inside() != self.sticking:
            # A ball that comes back slipping has slipped since it was lost.
            began = self._steps if self._lost is None or self._flies else self._lost
            self._change(not self.sticking, self._event(began if self.sticking else self._steps))
            self._lost, self._flies = None, False
        elif self._lost is not None:
            self._lost, self._flies = None, False
        self._steps += 1

    def _miss(self, data: Any) -> None:
        """Counts a step without a normal force; records a lift-off if the ball is too far from the wall for a hop."""
        if self._lost is None:
            self._lost = self._steps
        if not self._flies and float(self._surface.gap(data.xpos[self._ball])) > self._radius:
            self._flies = True
            self._change(False, self._event(self._lost, EventKind.LIFT_OFF))

    def _presses(self, data: Any) -> bool:
        """True if there is a contact with a normal force; stores the force in ``self._wrench``."""
        if data.ncon == 0:
            return False
        mujoco.mj_contactForce(self._model, data, 0, self._wrench)
        return self._wrench.item(0) > 0

    def holds(self, data: Any) -> bool:
        """True if there is a contact force in ``data`` inside the cone of the present coefficient."""
        return self._presses(data) and self._inside()

    def _inside(self) -> bool:
        """True if the force in ``self._wrench`` is inside the cone of the present coefficient."""
        N, F1, F2 = self._force.tolist()
        # MuJoCo's pyramid lies inside the true cone: along its own tangents it allows |F1| + |F2| = mu N.
        friction = abs(F1) + abs(F2) if self._pyramidal else math.hypot(F1, F2)
        return bool(friction < _ON_CONE * self._mu * N)

    def events(self, data: Any) -> list[Event]:
        """The events so far, each with a bracket of one step; ``data`` is the present state with its own forces."""
        if not self._presses(data) or self.holds(data) == self.sticking:
            return list(self._events)
        slips_since = self._lost if self.sticking and self._lost is not None and not self._flies else self._steps
        return [*self._events, self._event(slips_since)]

    def coefficients(self, read: Callable[[], float]) -> tuple[float, float]:
        """Static and kinetic coefficient [1] as ``read`` finds them in the model, after each is written to it."""
        now, coefficients = self._mu, []
        for mu in (self._static, self._kinetic):
            self._write(mu)
            coefficients.append(read())
        self._write(now)
        return coefficients[0], coefficients[1]

    def correct(self, data: Any, N: float) -> None:
        """Subtracts from the contact's reference acceleration the lift that MuJoCo's cone gives to a slipping contact.

        MuJoCo's friction is the dual of a convex cone, so a ball that slips also rises from the wall: the residual r
        of the friction rows (acceleration less reference: damping b times the slip, plus its rate) demands the normal
        acceleration mu |r|, and the contact chatters. mu |r| is subtracted, with the present slip and its rate from the
        evaluation before. Errors of that rate die out as g / (1 + g) per evaluation, g = mu² (1 + m a²/J).

        A rigid contact is loaded by a depth of almost nothing, so that the least error of r would end it: a preload of
        a hundredth of the normal force, ``N`` [N] of the evaluation before, keeps the contact. To be called after the
        reference accelerations and before the forces.
        """
        if not self._corrects or data.nefc == 0 or self._mu == 0:
            return
        # The contact is the only constraint of the model. A pyramid's rows are the normal plus and less mu tangents.
        rows, aref = data.efc_J.reshape(data.nefc, -1), data.efc_aref
        if self._pyramidal:
            slip, reference = (rows[0::2] - rows[1::2]) / (2 * self._mu), (aref[0::2] - aref[1::2]) / (2 * self._mu)
        else:
            slip, reference = rows[1:3], aref[1:3]
        # MuJoCo's tangents jump as the wall turns and the ball's own axes turn fast: the acceleration of the evaluation
        # before is of use only with the Jacobian of that evaluation, in the world.
        tangents = data.contact.frame[0].reshape(3, 3)[1:]
        memory = data.userdata[-SLIP_MEMORY:].reshape(3, -1)
        r1, r2 = (tangents.dot(memory.dot(data.qacc)) - reference).tolist()
        memory[:] = tangents.T.dot(slip)
        lift = self._preload * N
        if self._near_cone(data, N):
            # The dual of the pyramid knows the larger component alone.
            lift += self._mu * (max(abs(r1), abs(r2)) if self._pyramidal else math.hypot(r1, r2))
        if self._pyramidal:
            aref[:] -= lift
        else:
            aref[0] -= lift

    def _near_cone(self, data: Any, N: float) -> bool:
        """True if friction was near its bound in the evaluation before.

        Read from its torque, which is known in the world; its force would need the contact frame of that evaluation.
        """
        t1, t2, t3 = data.qfrc_constraint[self._spin].tolist()
        lever = self._radius + 0.5 * float(data.efc_pos[0])  # MuJoCo's contact point lies midway in the depth
        return math.hypot(t1, t2, t3) >= NEAR_CONE * self._mu * N * lever

    def _event(self, step: int, kind: EventKind | None = None) -> Event:
        low, high = max(step - 1, 0) * self._dt, step * self._dt
        return Event(kind or (EventKind.SLIP if self.sticking else EventKind.STICK), 0.5 * (low + high), low, high)

    def _change(self, sticking: bool, event: Event) -> None:
        self._events.append(event)
        self.sticking = sticking
        if self._static != self._kinetic:
            self._write(self._static if sticking else self._kinetic)

    def _write(self, mu: float) -> None:
        """Sets the coefficient in the model, also in the contact pair if there is one."""
        self._mu = mu
        self._model.geom_friction[:, 0] = mu
        self._model.geom_condim[:] = condim(mu, self._settings)
        self._model.pair_friction[:, :2] = mu
        self._model.pair_dim[:] = condim(mu, self._settings)
