"""Route 1 of a mechanism that switches: joint coordinates, Coulomb's law solved for all contacts at once."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism.contact.free_slides import FreeSlides
from proofroll.elements.mechanism.contact.modes import REST, ContactMode, Features, closed_in, features_of
from proofroll.elements.mechanism.contact.states import ContactSolution
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.numerics.hybrid import StretchLaw, Transition
from proofroll.truth.switching.contact_guards import SolvedContacts
from proofroll.truth.switching.contact_stretches import ContactStretches
from proofroll.truth.switching.contact_taylor import ModeSymbols
from proofroll.truth.switching.held_route import BodyStates
from proofroll.truth.tree.contact_tree_symbols import TreeSymbols


class ContactTree(ContactStretches):
    """Stretches of a mechanism in the coordinates of its tree.

    Implements :class:`proofroll.truth.numerics.hybrid.HybridRoute`.
    """

    _begins_by, _by_collocation = 15, True

    def __init__(self, dynamics: ContactDynamics, tolerance: float, size: float) -> None:
        self.dynamics = dynamics
        dynamics.equations.record()
        super().__init__(dynamics, dynamics.mechanism.nq + dynamics.mechanism.nv, tolerance, size)

    def _symbols(self) -> ModeSymbols:
        return TreeSymbols(self.dynamics)

    @property
    def start(self) -> Array:
        """State at time 0."""
        return np.append(np.concatenate(self.dynamics.mechanism.start()), 0.0)

    def bodies(self, state: Array) -> BodyStates:
        """Places, velocities, quaternions and angular velocities of all bodies, world axes."""
        motion = self.dynamics.equations.tree.at(*self.dynamics.parts(state)[:2])
        turned = Rotation.from_matrix(motion.R_WB[:-1]).as_quat(scalar_first=True)
        return motion.p_WB[:-1], motion.v_WB[:-1], turned, motion.w_WB[:-1]

    def _law(self, state: Array, mode: ContactMode, signs: tuple[int, ...] | None = None) -> StretchLaw:
        law = super()._law(state, mode, signs)
        return law._replace(corrected=self.dynamics.equations.watching(law.corrected))

    def _law_inside(self, state: Array, mode: ContactMode) -> StretchLaw:
        return super()._law(state, mode)

    def begin(self) -> Transition[ContactMode]:
        """See the protocol."""
        rough = self._moved_on(self.start, self.dynamics.rough_start())
        mode, margin = self.decided(self.start, rough)
        state = self.dynamics.eliminated(self.start, mode)
        return Transition(state, mode, (), margin)

    def _struck(
        self, state: Array, rough: ContactMode, laws: Sequence[float], sideways: Sequence[float]
    ) -> tuple[Array, list[bool], float]:
        (q, v, time), features, closed_mask = self.dynamics.parts(state), features_of(rough), closed_in(rough)
        which = np.flatnonzero(closed_mask).tolist()
        normal, tangential = (np.array([law[k] for k in which]) for law in (laws, sideways))
        velocity, impulse, margin = self.dynamics.struck(q, v, which, normal, time, tangential, features)
        stays, touching = list(closed_mask), self.dynamics.at(q, velocity, time, features).touching
        for pressed, k in zip(impulse[:, 0] > 0, which, strict=True):
            leaves = float(touching[k].normal @ touching[k].slide) > REST
            stays[k] = not laws[k] if pressed else not leaves
        return np.concatenate([q, velocity, [time]]), stays, margin

    def _forces(self, state: Array, mode: ContactMode) -> ContactSolution:
        q, v, time = self.dynamics.parts(state)
        return self.dynamics.solve(q, v, mode, time)

    def _touching(self, state: Array, features: Features | None) -> Sequence[Touching]:
        return self.dynamics.at(*self.dynamics.parts(state), features).touching

    def _solution(self, state: Array, mode: ContactMode) -> SolvedContacts:
        solution, v = self._forces(state, mode), self.dynamics.parts(state)[1]
        return SolvedContacts(
            touching=solution.state.touching,
            mode=solution.mode,
            velocity=v,
            acceleration=solution.acceleration,
            slide_rate=solution.slide_rate,
            force=solution.force,
            response=solution.response,
            splits=solution.splits,
            spread=solution.spread,
            shifts=solution.shifts,
        )

    def _free_slides(self, state: Array, rough: ContactMode) -> FreeSlides:
        q, v, time = self.dynamics.parts(state)
        return self.dynamics.at(q, v, time, features_of(rough)).free_slides

    def _decided(self, state: Array, rough: ContactMode, leaving: Sequence[int] = ()) -> tuple[ContactMode, float]:
        q, v, time = self.dynamics.parts(state)
        return self.dynamics.decided(q, v, rough, time, leaving)
