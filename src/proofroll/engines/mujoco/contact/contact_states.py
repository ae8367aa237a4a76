"""States of contacts in MuJoCo's steps, from the forces of its own contact rows: open, sticking or slipping."""

import math
from typing import Any

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.contacts.step_events import (
    OPEN,
    SLIP,
    STICK,
    States,
    StepEvents,
    least_slip,
    state_of,
)
from proofroll.elements.mechanism.scene.shapes.shapes import BoxShape
from proofroll.engines.mujoco.contact.mechanism_contacts import Contacts
from proofroll.engines.mujoco.settings import MujocoSettings

# MuJoCo's solver projects a force onto the cone, so that of a slipping contact lies on it to round-off.
_ON_CONE = 1 - 1e-9
# Way of a contact point in one step, in parts of the smallest box, beyond which it is another point of the box.
_JUMPS = 0.1


class ContactStates:
    """Watches the contacts of a run.

    Attributes:
        events: of all contacts.
        behind: time by which forces in MjData are older than its state after a step [s].
    """

    def __init__(self, contacts: Contacts, mechanism: Mechanism, settings: MujocoSettings) -> None:
        self.events = StepEvents(mechanism.contacts, settings.dt)
        self._open = (OPEN,) * len(mechanism.contacts)
        self._first = {geom: number for geom, (number, _) in contacts.of_geom.items()}
        self._contacts, self._friction = contacts, [contact.friction for contact in mechanism.contacts]
        self._pyramidal = settings.cone == "pyramidal"
        # of the forces in MjData after a step: those of its start, or of the last stage of RK4
        self.behind = 0.0 if settings.integrator == "RK4" else settings.dt
        self._held = least_slip(mechanism.gravity, settings.dt)
        shapes = [shape for contact in mechanism.contacts for shape in (contact.shape_a, contact.shape_b)]
        halves = [float(np.min(shape.half)) for shape in shapes if isinstance(shape, BoxShape)]
        self._jump = _JUMPS * min(halves, default=1.0)
        self._last: tuple[list[tuple[int, int]], Any, list[int]] = [], np.zeros((0, 3)), []

    def observe(self, data: Any) -> None:
        """Takes the states of all contacts in the last step of ``data``."""
        self.events.observe(data.time - self.behind, self._states(data))

    def _states(self, data: Any) -> States:
        """States of all contacts in the last step; one at several points sticks if one does."""
        if not data.ncon:
            return self._open
        contacts, forces, rates = data.contact, data.efc_force.tolist(), data.efc_vel.tolist()
        firsts = [self._first[geom] for _, geom in contacts.geom.tolist()]
        states_found = [
            self._state(forces, rates, row, first)
            for row, first in zip(contacts.efc_address.tolist(), firsts, strict=True)
        ]
        states = [*self._open]
        for number, state in zip(self._numbers(data, firsts, states_found), states_found, strict=True):
            if state != OPEN:
                states[number] = state if states[number] == OPEN else min(state, states[number])
        return tuple(states)

    def _state(self, forces: list[float], rates: list[float], row: int, number: int) -> int:
        """State of a contact of MuJoCo, whose forces and rates begin at ``row``; below 0: it has none."""
        if row < 0:
            return OPEN
        mu = self._friction[number]
        if not 0 < mu < math.inf:
            return state_of(forces[row], 0.0, mu)
        if self._pyramidal:  # edges: the normal plus or less mu times a tangent
            a, b, c, d = forces[row : row + 4]
            state = state_of(a + b + c + d, abs(a - b) + abs(c - d), _ON_CONE * (a + b + c + d))
            v1, v2 = rates[row] - rates[row + 1], rates[row + 2] - rates[row + 3]
            return STICK if state == SLIP and math.hypot(v1, v2) <= 2 * mu * self._held else state
        N = forces[row]
        state = state_of(N, math.hypot(forces[row + 1], forces[row + 2]), _ON_CONE * mu * N)
        return STICK if state == SLIP and math.hypot(rates[row + 1], rates[row + 2]) <= self._held else state

    def _numbers(self, data: Any, firsts: list[int], states_found: list[int]) -> list[int]:
        """Number of each of MuJoCo's contacts; of boxes those are looked up where points change or jump."""
        if not self._contacts.boxes.intersection(firsts):
            return firsts
        contacts, places = [*zip(firsts, states_found, strict=True)], data.contact.pos.copy()
        last_contacts, last_places, numbers = self._last
        if contacts != last_contacts or np.abs(places - last_places).max() > self._jump:
            numbers = [self._contacts.owner(data, data.contact[index])[0] for index in range(data.ncon)]
        self._last = contacts, places, numbers
        return numbers
