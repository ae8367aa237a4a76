"""Route 1 of a mechanism whose bodies touch: joint coordinates, Coulomb's law solved for all contacts at once."""

from collections.abc import Sequence

import numpy as np

from proofroll.core.errors import NotUnique
from proofroll.elements.mechanism.contacts.acting import Acting, ContactMode
from proofroll.elements.mechanism.contacts.coulomb import PAINLEVE
from proofroll.elements.mechanism.contacts.dynamics import ContactDynamics, ContactSolution
from proofroll.elements.mechanism.contacts.touching import Touching
from proofroll.elements.mechanism.rotations import Array
from proofroll.truth.hybrid import Stretch, Transition
from proofroll.truth.mechanism.contact_guards import STOPPED, striking
from proofroll.truth.mechanism.contact_stretches import ContactStretches, SolvedContacts


class ContactTree(ContactStretches):
    """Stretches of a mechanism in the coordinates of its tree.

    Implements :class:`proofroll.truth.hybrid.HybridRoute`.
    """

    def __init__(self, dynamics: ContactDynamics, tolerance: float, size: float) -> None:
        self.dynamics = dynamics
        super().__init__(dynamics, dynamics.mechanism.nq + dynamics.mechanism.nv, tolerance, size)

    def begin(self) -> Transition[ContactMode]:
        """See the protocol."""
        mode, margin = self.dynamics.begin()
        state = self.dynamics.eliminated(np.concatenate([*self.dynamics.mechanism.start(), [0.0]]), mode)
        return Transition(state, mode, (), margin)

    def _torn(self, leg: Stretch[ContactMode]) -> NotUnique:
        slipping = next(c.name for c, own in zip(self.contacts, leg.mode, strict=True) if own.kind == "slip")
        return NotUnique(f"from t = {leg.end:.6g} s on " + PAINLEVE.format(name=slipping))

    def _leaving(self, state: Array, mode: ContactMode, k: int) -> Acting:
        solution = self._forces(state, mode)
        own = mode[k]
        assert own.along is not None  # other contacts are refused before
        sign = -float(np.sign(np.dot(own.along, solution.force[k])))
        x, y, z = (sign * np.array(own.along)).tolist()
        return Acting("slip", (x, y, z), (x, y, z))

    def _impact(self, leg: Stretch[ContactMode], hit: int) -> Transition[ContactMode]:
        contacts, dynamics = self.contacts, self.dynamics
        q, v, time = dynamics.parts(leg.last)
        touching = dynamics.at(q, v).touching
        hits = striking(leg.mode, touching, hit, leg.end)
        # dry friction of joints gives no impulse
        closed = [k for k, own in enumerate(leg.mode) if (own.kind != "open" or k in hits) and not contacts[k].bound]
        speed = -float(touching[hit].normal @ touching[hit].slide)
        law = np.array([contacts[k].restitution if k in hits else 0.0 for k in closed])
        after, impulse, margin = dynamics.struck(q, v, closed, law)
        delay = 0.0
        if self._settles(hit, speed, contacts[hit].restitution):
            free = dynamics.solve(q, after, leg.mode, time)
            pull = -float(touching[hit].normal @ free.slide_rate[hit])
            delay = self._bouncing(speed * contacts[hit].restitution, pull, contacts[hit].restitution)
            after, impulse, margin = dynamics.struck(q, v, closed, np.zeros(len(closed)))
        state = np.concatenate([q, after, [time]])
        stays = [bool(contact.bound) for contact in contacts]
        for place, k in enumerate(closed):
            e = contacts[k].restitution if k in hits and not delay else 0.0
            stays[k] = impulse[place, 0] > 0 and not e
            if k not in hits and not impulse[place, 0] > 0:
                stays[k] = float(touching[k].normal @ dynamics.at(q, after).touching[k].slide) <= STOPPED
        first = ("settle" if delay else "impact", contacts[hit].name)
        return self._after(leg, state, stays, (first,), margin, delay)

    def _forces(self, state: Array, mode: ContactMode) -> ContactSolution:
        q, v, time = self.dynamics.parts(state)
        return self.dynamics.solve(q, v, mode, time)

    def _touching(self, state: Array) -> Sequence[Touching]:
        return self.dynamics.at(*self.dynamics.parts(state)).touching

    def _solved(self, state: Array, mode: ContactMode) -> SolvedContacts:
        solution, v = self._forces(state, mode), self.dynamics.parts(state)[1]
        return SolvedContacts(
            solution.state.touching, v, solution.acceleration, solution.slide_rate, solution.force, solution.response
        )

    def _decided(self, state: Array, closed: Sequence[bool], still: Sequence[bool]) -> tuple[ContactMode, float]:
        q, v, time = self.dynamics.parts(state)
        return self.dynamics.decided(q, v, closed, still, time)
