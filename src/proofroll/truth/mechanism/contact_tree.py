"""Route 1 of a mechanism whose bodies touch: joint coordinates, modes by Coulomb's law at all contacts at once."""

from __future__ import annotations

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contacts.acting import FAINT, OPEN, Acting, ContactMode, across
from proofroll.elements.mechanism.contacts.coulomb import PAINLEVE
from proofroll.elements.mechanism.contacts.dynamics import ContactDynamics
from proofroll.elements.mechanism.rotations import Array
from proofroll.truth.hybrid import Stretch, Transition, between, walked
from proofroll.truth.mechanism.contact_guards import (
    AT_REST,
    STANDS,
    STOPPED,
    events,
    faint_time,
    guard_value,
    guards_of,
    noise_of,
    refuse_turning_onset,
    striking,
)
from proofroll.truth.mechanism.joint_switching import SETTLED


class ContactTree:
    """The stretches of a mechanism in the coordinates of its tree. See :class:`proofroll.truth.hybrid.HybridRoute`."""

    def __init__(self, dynamics: ContactDynamics, tolerance: float, size: float) -> None:
        self.dynamics, self.contacts = dynamics, dynamics.contacts
        self._nq, self._size = dynamics.mechanism.nq, size
        self._tolerance = np.full(self._nq + dynamics.mechanism.nv, tolerance)
        self._fastest: dict[int, float] = {}
        self._span: float | None = None

    def begin(self) -> Transition[ContactMode]:
        """See the protocol."""
        mode, margin = self.dynamics.begin()
        state = self.dynamics.eliminated(np.concatenate(self.dynamics.mechanism.start()), mode)
        return Transition(state, mode, (), margin)

    def walk(self, time: float, state: Array, mode: ContactMode, until: float) -> Stretch[ContactMode]:
        """See the protocol."""
        if self._stands(state, mode):
            return Stretch(time, until, mode, state, state, None)
        start, begun = self._kicked(time, state, mode)
        guards, visited = guards_of(self.contacts, mode), list[tuple[float, Array]]()
        end, last, guard = walked(
            lambda _, y: self.dynamics.rate(y, mode),
            begun,
            start,
            until,
            tolerance=self._tolerance,
            guards=lambda y: self._guards(y, mode),
            corrected=lambda y: self.dynamics.eliminated(y, mode),
            first_step=self._span,
            noise=noise_of(guards, self._size),
            visited=visited,
        )
        if guard is not None and guards[guard].kind == "still":
            k = guards[guard].contact
            found = self.dynamics.solve(*self._parts(last), mode)
            rest = faint_time(mode[k], found.state.touching[k], found.slide_rate[k])
            last, end = last + rest * self.dynamics.rate(last, mode), end + rest
        self._span = end - time if end > time else None
        return Stretch(time, end, mode, state, last, guard, visited)

    def _kicked(self, time: float, state: Array, mode: ContactMode) -> tuple[Array, float]:
        """The state and time a moment later where a slip begins from rest in two dimensions: with a direction."""
        found = self.dynamics.solve(*self._parts(state), mode)
        wait = 0.0
        for k, own in enumerate(mode):
            begins = own.kind == "slip" and own.along is None and self.dynamics.friction[k]
            if begins and np.linalg.norm(across(found.state.touching[k])) < FAINT:
                wait = max(wait, 2 * FAINT / float(np.linalg.norm(found.slide_rate[k])))
        return (state, time) if not wait else (state + wait * self.dynamics.rate(state, mode), time + wait)

    def within(self, leg: Stretch[ContactMode], times: FloatArray) -> FloatArray:
        """See the protocol."""
        if not leg.visited:
            return np.array([leg.first for _ in times])
        rate, corrected = self.dynamics.rate, self.dynamics.eliminated
        return between(
            lambda _, y: rate(y, leg.mode), leg.visited, times, self._tolerance, lambda y: corrected(y, leg.mode)
        )

    def change(self, leg: Stretch[ContactMode]) -> Transition[ContactMode]:
        """See the protocol."""
        assert leg.guard is not None  # nothing changes at the end of time
        k, kind = guards_of(self.contacts, leg.mode)[leg.guard]
        mode, state = list(leg.mode), leg.last
        if kind == "tear":
            slipping = next(c.name for c, own in zip(self.contacts, leg.mode, strict=True) if own.kind == "slip")
            raise Refused(f"from t = {leg.end:.6g} s on " + PAINLEVE.format(name=slipping))
        if kind == "lift":
            mode[k] = OPEN
            return Transition(state, tuple(mode), (("lift_off", self.contacts[k].name),))
        if kind == "break":
            refuse_turning_onset(self.contacts[k], mode[k])
            mode[k] = self._leaving(state, leg.mode, k)
            return Transition(state, tuple(mode), (("slip", self.contacts[k].name),))
        if kind == "still":
            return self._after(leg, state, [own.kind != "open" for own in mode], ())
        return self._struck(leg, k)

    def _leaving(self, state: Array, mode: ContactMode, k: int) -> Acting:
        """A slip that begins at the bound of friction, against the force that held."""
        found = self.dynamics.solve(*self._parts(state), mode)
        own = mode[k]
        assert own.along is not None  # others are refused
        sign = -float(np.sign(np.dot(own.along, found.force[k])))
        x, y, z = (sign * np.array(own.along)).tolist()
        return Acting("slip", (x, y, z), (x, y, z))

    def _struck(self, leg: Stretch[ContactMode], hit: int) -> Transition[ContactMode]:
        """Transition of the motion by an impact."""
        contacts, dynamics = self.contacts, self.dynamics
        q, v = self._parts(leg.last)
        found = dynamics.at(q, v).touching
        hits = striking(leg.mode, found, hit)
        closed = [k for k, own in enumerate(leg.mode) if own.kind != "open" or k in hits]
        speed = -float(found[hit].normal @ found[hit].slide)
        fastest = self._fastest.setdefault(hit, speed)
        law = np.array([contacts[k].restitution if k in hits else 0.0 for k in closed])
        after, impulse, margin = dynamics.struck(q, v, closed, law)
        delay = 0.0
        if contacts[hit].restitution and speed < SETTLED * fastest:
            free = dynamics.solve(q, after, leg.mode)
            pull = -float(found[hit].normal @ free.slide_rate[hit])
            delay = 2 * speed * contacts[hit].restitution / (pull * (1 - contacts[hit].restitution))
            after, impulse, margin = dynamics.struck(q, v, closed, np.zeros(len(closed)))
        state = np.concatenate([q, after])
        stays = [False] * len(contacts)
        for place, k in enumerate(closed):
            e = contacts[k].restitution if k in hits and not delay else 0.0
            stays[k] = impulse[place, 0] > 0 and not e
            if k not in hits and not impulse[place, 0] > 0:
                stays[k] = float(found[k].normal @ dynamics.at(q, after).touching[k].slide) <= STOPPED
        first = ("settle" if delay else "impact", contacts[hit].name)
        return self._after(leg, state, stays, (first,), margin, delay)

    def _after(
        self,
        leg: Stretch[ContactMode],
        state: Array,
        closed: list[bool],
        happened: tuple[tuple[str, str], ...],
        margin: float = np.inf,
        delay: float = 0.0,
    ) -> Transition[ContactMode]:
        """The mode that follows from the forces, with what stopped taken to stand."""
        found = self.dynamics.at(*self._parts(state)).touching
        still = [
            shut and float(np.linalg.norm(across(each))) <= STOPPED for shut, each in zip(closed, found, strict=True)
        ]
        own = tuple(
            Acting("stick" if stops else "slip" if shut else "open") for shut, stops in zip(closed, still, strict=True)
        )
        state = self.dynamics.eliminated(state, own)
        mode, sure = self.dynamics.decided(*self._parts(state), closed, still)
        changed = events(self.contacts, leg.mode, mode, self._stands(state, mode))
        struck = {name for _, name in happened}
        said = (*happened, *(item for item in changed if item[1] not in struck))
        return Transition(state, mode, said, np.inf if delay else min(margin, sure), delay)

    def _stands(self, state: Array, mode: ContactMode) -> bool:
        """True if nothing moves, and nothing will."""
        q, v = self._parts(state)
        if np.abs(v).max() > AT_REST or any(own.kind == "slip" for own in mode):
            return False
        return float(np.abs(self.dynamics.solve(q, v, mode).acceleration).max()) <= STANDS

    def _parts(self, state: Array) -> tuple[Array, Array]:
        return state[: self._nq], state[self._nq :]

    def _guards(self, state: Array, mode: ContactMode) -> FloatArray:
        found = self.dynamics.solve(*self._parts(state), mode)
        friction, touching = self.dynamics.friction, found.state.touching
        return np.array(
            [
                guard_value(guard, mode, friction, touching, found.force, found.response)
                for guard in guards_of(self.contacts, mode)
            ]
        )
