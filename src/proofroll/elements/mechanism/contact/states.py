"""Contacts at one state: kinematics, and accelerations and forces in a mode."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from proofroll.elements.mechanism.contact.free_slides import FreeSlides, free_slides
from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.contact.rolling_and_spin import opposed_rates
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.dynamics.analysis import RANK
from proofroll.elements.mechanism.dynamics.joint_coordinates import Solution
from proofroll.elements.mechanism.scene.rotations import Array, cross


@dataclass(frozen=True)
class ContactsNow:
    """Kinematics and free accelerations of the contacts at one state, independent of the mode.

    Attributes:
        contacts: their laws.
        solution: of the mechanism without forces of contact.
        mass: of the velocities, (nv, nv).
        W: accelerations caused by unit forces along the velocities, (nv, nv).
        loose: the same without loops, couplings and motions, (nv, nv).
        touching: geometry and rates of each contact.
        J: derivative of each slide by the velocities, (contacts, 3, nv).
        bias: rate of each slide where v̇ = 0, (contacts, 3).
    """

    contacts: Sequence[object]
    solution: Solution
    mass: Array
    W: Array
    loose: Array
    touching: tuple[Touching, ...]
    J: Array
    bias: Array

    @cached_property
    def free_slides(self) -> FreeSlides:
        """Slides of the contacts without their forces."""
        solution = self.solution
        joint_force = solution.C.T @ solution.multipliers
        return free_slides(self.touching, self.J, self.bias, solution.acceleration, self.W, self.loose, joint_force)


@dataclass(frozen=True)
class ContactSolution:
    """Accelerations and forces in a mode.

    Attributes:
        state: state of the contacts that they belong to.
        mode: the mode, with lines of contacts as they lie now.
        acceleration: v̇, (nv).
        force: on body a of each contact [N], (contacts, 3); the smallest where they are not determinate.
        response: Painlevé's measure, above 0 in a possible motion: response to normal forces with friction over the
            response without.
        shifts: ways to split a load that contacts share: changes of the forces, (contacts, 3, ways).
        spread: change of v̇ with these, the whole of unit length.
    """

    state: ContactsNow
    mode: ContactMode
    acceleration: Array
    force: Array
    response: float
    shifts: Array
    spread: float

    @cached_property
    def slide_rate(self) -> Array:
        """Rate of each slide [m/s²], (contacts, 3)."""
        state = self.state
        return opposed_rates(state.contacts, state.touching, state.J @ self.acceleration + state.bias)

    @property
    def undetermined(self) -> Array:
        """Changes of the forces that cause no motion, (contacts, 3, ways); across a line joints hold, too."""
        lines = [k for k, acting in enumerate(self.mode) if acting.kind == "stick" and acting.along is not None]
        across = np.zeros((*self.force.shape, len(lines)))
        for way, k in enumerate(lines):
            across[k, :, way] = cross(self.state.touching[k].normal, np.array(self.mode[k].along))
        return np.concatenate([self.shifts, across], axis=2)

    @property
    def determinate(self) -> NDArray[np.bool_]:
        """True for each determinate component of ``force``, (contacts, 3)."""
        return np.asarray(np.abs(self.undetermined).max(axis=2, initial=0.0) <= RANK)

    @cached_property
    def _normals(self) -> Array:
        return np.array([touch.normal for touch in self.state.touching]).reshape(-1, 3)

    @property
    def splits(self) -> Array:
        """Changes of the normal forces with the ways to split a load, (contacts, ways)."""
        return np.asarray(np.einsum("ki,kiw->kw", self._normals, self.shifts))

    @property
    def normal_forces(self) -> Array:
        """Normal force of each contact [N], (contacts), whatever its axes are; NaN where it is not determinate."""
        shared = np.abs(self.splits).max(axis=1, initial=0.0) > RANK
        return np.where(shared, np.nan, np.einsum("ki,ki->k", self._normals, self.force))

    def lasts(self, mode: ContactMode) -> float:
        """Time until one of the first contacts that is open closes at constant acceleration [s]; infinite: never."""
        times = [np.inf]
        count = len(mode)
        for acting, touch, rate in zip(mode, self.state.touching[:count], self.slide_rate[:count], strict=True):
            if acting.kind == "open":
                opening = touch.normal @ rate + touch.normal_rate @ touch.slide
                roots = np.roots([opening / 2, touch.normal @ touch.slide, touch.gap])
                times += [root.real for root in roots if root.imag == 0 < root.real]
        return min(times)
