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
        # arms of what shares the cone: forces and speeds of sliding, then moments over arms and turning times arms
        self._arms = [[1.0, 1.0, *contact.shared_arms] for contact in mechanism.contacts]
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
        arms = self._arms[number]
        if self._pyramidal:  # edges: the normal plus or less mu times a tangent
            first, second = (slice(row + side, row + 2 * len(arms), 2) for side in (0, 1))
            edges = [*zip(forces[first], forces[second], strict=True)]
            N, friction = sum(a + b for a, b in edges), sum(abs(a - b) for a, b in edges)
            state = state_of(N, friction, _ON_CONE * N)
            speeds = [v1 - v2 for v1, v2 in zip(rates[first], rates[second], strict=True)]
            return STICK if state == SLIP and math.hypot(*speeds) <= 2 * mu * self._held else state
        N, along = forces[row], slice(row + 1, row + 1 + len(arms))
        friction = math.hypot(*(force / arm for force, arm in zip(forces[along], arms, strict=True)))
        state = state_of(N, friction, _ON_CONE * mu * N)
        slip = math.hypot(*(rate * arm for rate, arm in zip(rates[along], arms, strict=True)))
        return STICK if state == SLIP and slip <= self._held else state

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
