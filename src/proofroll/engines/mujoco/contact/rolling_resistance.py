"""Rolling resistance in MuJoCo: a torque computed in each step, as its own one shares a cone with sliding friction.

The torque is needed before MuJoCo solves for the normal force that bounds it, which is foreseen from two steps before.
"""

from typing import Any

import mujoco
import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.rolling_and_spin import largest_response, rolling_levers, turning_frictions
from proofroll.elements.mechanism.run.contacts.step_events import SLIP
from proofroll.elements.mechanism.scene.rotations import Array, cross
from proofroll.engines.mujoco.contact.contact_states import ContactStates
from proofroll.engines.mujoco.contact.mechanism_contacts import Contacts
from proofroll.engines.mujoco.settings import MujocoSettings

# Change of an angular velocity in one step, relative to it, from which a torque may stop it and the response is needed.
_SLOW = 0.25


class RollingResistance:
    """Torques of rolling resistance on the bodies of a run; false if it has none.

    Attributes:
        applied: moments on the first bodies of the contacts in the last evaluation [N m], (contacts, 3).
        of_step: moments of the last step [N m].
        levers: coefficient of each contact [m], (contacts,).
    """

    def __init__(self, model: Any, mechanism: Mechanism, settings: MujocoSettings, contacts: Contacts) -> None:
        self._model, self._contacts, self._pyramidal = model, contacts, settings.cone == "pyramidal"
        self._frictions = [friction for friction in turning_frictions(mechanism.contacts) if not friction.spins]
        self.levers = rolling_levers(self._frictions, len(mechanism.contacts))
        pairs = [mechanism.contacts[friction.pressed_by] for friction in self._frictions]
        self._bodies = [(model.body(contact.body_a).id, model.body(contact.body_b).id) for contact in pairs]
        names = [f"contact{law.pressed_by}{'a' if law.bend > 0 else 'b'}" for law in self._frictions]
        self._balls = [model.geom(name).id for name in names]
        self._dt, self._lag = settings.dt, settings.velocity_lag
        count = len(self._frictions)
        self.applied, self.of_step = np.zeros((2, count, 3))
        self._last_moving = np.zeros((count, 2, 3))
        self._ease = np.full(count, np.inf)  # largest response to a torque, (rad/s²) / (N m)
        self._times, self._normals = [0.0, 0.0], [np.zeros(count), np.zeros(count)]  # of the last two steps

    def __bool__(self) -> bool:
        return bool(self._frictions)

    def begin(self, present: Any, behind: Any) -> None:
        """Takes the forces at the start.

        Args:
            present: MuJoCo's data with velocities of the time of its positions.
            behind: MuJoCo's data with velocities that lag.
        """
        self._normals = [self.pressing(present)] * 2
        now, before = self._moving(present), self._moving(behind)
        self._last_moving = before - (now - before) * (self._dt / self._lag) if self._lag else now

    def remember(self, data: Any, time: float) -> None:
        """Takes the normal forces of a step from ``data``, which belong to a ``time`` [s]."""
        self._times, self._normals = [self._times[1], time], [self._normals[1], self.pressing(data)]
        self._last_moving = self._moving(data)

    def pressing(self, data: Any) -> Array:
        """Normal force on each contact with resistance [N], by the last forces of ``data``."""
        normals = np.zeros(len(self._frictions))
        rows, forces = data.contact.efc_address.tolist(), data.efc_force
        for index, row in enumerate(rows):
            place = self._place(data, index)
            if row >= 0 and place is not None:
                edges = 2 * (int(data.contact[index].dim) - 1) if self._pyramidal else 0
                normals[place] += forces[row : row + max(edges, 1)].sum()
        return normals

    def foreseen(self, time: float) -> Array:
        """Normal forces at a time [N], extrapolated from the last two steps."""
        (time_before, time_last), (N_before, N) = self._times, self._normals
        slope = (N - N_before) / (time_last - time_before) if time_last > time_before else np.zeros_like(N)
        return np.asarray(np.maximum(N + slope * (time - time_last), 0.0))

    def apply(self, data: Any, normals: Array, states: ContactStates, last: Array) -> Array:
        """Adds the torques to ``data``, whose poses, velocities and contacts are those of its state.

        Args:
            data: MuJoCo's data, with accelerations of the evaluation before.
            normals: normal forces [N].
            states: of the contacts in the last step.
            last: moments of that evaluation [N m].

        Returns:
            The moments on the first bodies of the contacts [N m], (contacts, 3).
        """
        moments, directions = np.zeros((len(self._frictions), 3)), self._directions(data)
        moving = self._moving(data)
        later_moving = moving + (moving - self._last_moving) * (self._lag / self._dt)
        for place, (friction, N) in enumerate(zip(self._frictions, normals.tolist(), strict=True)):
            if N <= 0.0 or place not in directions:
                continue
            resisted = friction.opposed(directions[place], *later_moving[place])
            bound, rate = friction.friction * N, float(np.linalg.norm(resisted))
            moves = friction.bend and rate and states.events.state(friction.pressed_by) == SLIP
            if moves or self._dt * self._ease[place] * bound < _SLOW * rate:
                moments[place] = -bound / rate * resisted
                continue
            moments[place] = self._stopping(data, place, directions[place], last[place], states)
            size = float(np.linalg.norm(moments[place]))
            if size > bound:
                moments[place] = -bound / rate * resisted if rate else moments[place] * (bound / size)
        for (a, b), moment in zip(self._bodies, moments, strict=True):
            data.xfrc_applied[a, 3:] += moment
            data.xfrc_applied[b, 3:] -= moment
        self.applied = moments
        return moments

    def _stopping(self, data: Any, place: int, normal: Array, last: Array, states: ContactStates) -> Array:
        """Moment with which the bodies do not turn after the step, while the contacts hold what they do [N m]."""
        model, friction, (a, b) = self._model, self._frictions[place], self._bodies[place]
        of_a, of_b = np.zeros((2, 3, model.nv))
        mujoco.mj_jacBody(model, data, None, of_a, a)
        mujoco.mj_jacBody(model, data, None, of_b, b)
        row = friction.resisted(normal, of_a - of_b)
        held_rows = self._held_rows(data, states)
        stacked = np.concatenate([row, held_rows])
        ways = np.zeros_like(stacked)
        mujoco.mj_solveM(model, data, ways, stacked)
        responses = stacked @ ways.T
        ease = self._ease[place] = largest_response(responses[:3, :3], responses[3:, :3], responses[3:, 3:])
        if not ease:
            return np.zeros(3)
        turning_after = row @ (data.qvel + self._dt * data.qacc)
        return np.asarray(last - turning_after / (ease * self._dt))

    def _held_rows(self, data: Any, states: ContactStates) -> Array:
        """Rows of pressing contacts at zero, (rows, nv): those of friction only where it sticks."""
        model, rows = self._model, np.zeros((data.nefc, self._model.nv))
        if mujoco.mj_isSparse(model):
            mujoco.mju_sparse2dense(rows, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
        else:
            rows[:] = np.reshape(data.efc_J, rows.shape)
        held_rows = [np.zeros((0, model.nv))]
        for index, row in enumerate(data.contact.efc_address.tolist()):
            if row >= 0:
                number, dim = self._contacts.of_geom[int(data.contact[index].geom[1])][0], int(data.contact[index].dim)
                contact_rows = rows[row : row + max(2 * (dim - 1), 1)] if self._pyramidal else rows[row : row + dim]
                if states.events.state(number) == SLIP:  # the mean of a pyramid's edges is the normal
                    contact_rows = contact_rows.mean(axis=0)[None] if self._pyramidal else contact_rows[:1]
                held_rows.append(contact_rows)
        return np.concatenate(held_rows)

    def _moving(self, data: Any) -> Array:
        """Motion of each contact, first body against second, as :meth:`.TurningFriction.opposed` takes it, (n, 2, 3).

        Angular velocity [rad/s], or of a ball whose motion is resisted the slide of one that does not turn [m/s].
        """
        moving = np.zeros((len(self._frictions), 2, 3))
        for place, (friction, (a, b), ball) in enumerate(zip(self._frictions, self._bodies, self._balls, strict=True)):
            if friction.bend:
                centre = data.geom_xpos[ball]
                moving[place, 1] = self._velocity(data, a, centre) - self._velocity(data, b, centre)
            else:
                moving[place, 0] = data.cvel[a, :3] - data.cvel[b, :3]
        return moving

    def _velocity(self, data: Any, body: int, place: Array) -> Array:
        """Velocity of a body's material at a place [m/s]; 0 is the world."""
        if not body:
            return np.zeros(3)
        arm = place - data.subtree_com[self._model.body_rootid[body]]
        return np.asarray(data.cvel[body, 3:] + cross(data.cvel[body, :3], arm))

    def _directions(self, data: Any) -> dict[int, Array]:
        """Normals, from b to a, of the contacts with resistance that MuJoCo has found, by their places among these."""
        directions = dict[int, Array]()
        for index in range(data.ncon):
            place, contact = self._place(data, index), data.contact[index]
            if place is not None:  # MuJoCo's normal points from its first geom to the second
                directions[place] = self._contacts.owner(data, contact)[1] * contact.frame[:3]
        return directions

    def _place(self, data: Any, index: int) -> int | None:
        """Place of one of MuJoCo's contacts among those with resistance; None: it has none."""
        number = self._contacts.owner(data, data.contact[index])[0]
        return next((place for place, item in enumerate(self._frictions) if item.pressed_by == number), None)
