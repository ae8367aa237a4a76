"""Results of contacts: gaps, slip, forces; as variables of a run, and as observables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.observable import Observable, Role
from proofroll.elements.mechanism.contacts.touching import Moving, touch

if TYPE_CHECKING:
    from proofroll.elements.mechanism.model import Mechanism
    from proofroll.elements.mechanism.placed import Placed
    from proofroll.elements.mechanism.sampling import MechanismSample


class Followed(NamedTuple):
    """All contacts along a motion.

    Attributes:
        gap: [m], shape (time, contacts).
        slip: speed along the surfaces [m/s], shape (time, contacts).
        normal: unit vectors from b to a, shape (time, contacts, 3).
    """

    gap: FloatArray
    slip: FloatArray
    normal: FloatArray


def followed(placed: Placed) -> Followed:
    """Gaps, speeds of slip and normals of all contacts at all times."""
    mechanism = placed.mechanism
    shape = (len(placed.time), len(mechanism.contacts))
    gap, slip, normal = np.zeros(shape), np.zeros(shape), np.zeros((*shape, 3))
    still = np.zeros((len(placed.time), 3))

    def moving(body: str, k: int) -> Moving:
        i = mechanism.body_index[body]
        p, v, w = (still if i < 0 else values[:, i] for values in (placed.p_WB, placed.v_WB, placed.w_WB))
        return Moving(p[k], placed.R_WB[k, i], v[k], w[k])

    for c, contact in enumerate(mechanism.contacts):
        for k in range(shape[0]):
            found = touch(contact, moving(contact.body_a, k), moving(contact.body_b, k))
            across = found.slide - found.normal * (found.normal @ found.slide)
            gap[k, c], slip[k, c], normal[k, c] = found.gap, np.linalg.norm(across), found.normal
    return Followed(gap, slip, normal)


def contact_observables(mechanism: Mechanism, length: float, speed: float, force: float) -> Iterator[Observable]:
    """Observables of a mechanism with contacts; sizes below which nothing shows [m, m/s, N]."""
    if not mechanism.contacts:
        return
    yield Observable("gaps", "m", "distances between what may touch", Role.MOTION, floor=length)
    yield Observable("slips", "m/s", "speeds of slip of what may touch", Role.MOTION, floor=speed, asked_for=False)
    meaning = "normal forces between what may touch"
    yield Observable("normal_forces", "N", meaning, Role.REACTION, floor=force, headline=True, column=True)
    meaning = "forces between what may touch, where they are determinate all the time"
    yield Observable("contact_forces", "N", meaning, Role.REACTION, floor=force, asked_for=False)


def given_forces(mechanism: Mechanism, samples: Sequence[MechanismSample]) -> FloatArray:
    """Forces on body a of each contact [N], shape (time, contacts, 3); NaN where the engine cannot say.

    Raises:
        Diverged: they have another shape.
    """
    count = len(mechanism.contacts)
    empty = np.full((count, 3), np.nan)
    found = [empty if sample.contact_force is None else np.asarray(sample.contact_force) for sample in samples]
    for given in found:
        if given.size != 3 * count:
            raise Diverged(f"the engine gave contact_force with shape {given.shape} instead of {(count, 3)}")
    return np.array([given.reshape(count, 3) for given in found], dtype=np.float64)
