"""The start of contacts: which touch, which slide, and what no start may have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.contacts.touching import Moving, Touching, touch
from proofroll.elements.mechanism.kinematics import BodyMotion, Tree
from proofroll.elements.mechanism.model import Mechanism

# m: digits of a file, by which shapes may be apart or overlap and still touch.
TOUCHING = 1e-9
# m/s, and part of the fastest body's speed: digits of a file, by which what touches may part, approach or slide.
STILL = 1e-9


def touches(mechanism: Mechanism, motion: BodyMotion) -> tuple[Touching, ...]:
    """All contacts at one instant."""
    index = mechanism.body_index

    def moving(body: str) -> Moving:
        k = index[body]
        return Moving(motion.p_WB[k], motion.R_WB[k], motion.v_WB[k], motion.w_WB[k])

    return tuple(touch(contact, moving(contact.body_a), moving(contact.body_b)) for contact in mechanism.contacts)


def least_speed(motion: BodyMotion, found: Sequence[Touching]) -> float:
    """Speed below which a contact does not move at the start [m/s]."""
    return STILL * max([1.0, *(float(np.linalg.norm(each.slide)) for each in found), float(np.abs(motion.v_WB).max())])


def check_contacts(mechanism: Mechanism) -> None:
    """Nothing overlaps at the start, and nothing strikes.

    Raises:
        InputError: something does.
    """
    if not mechanism.contacts:
        return
    motion = Tree(mechanism).at(*mechanism.start())
    found = touches(mechanism, motion)
    still = least_speed(motion, found)
    for contact, each in zip(mechanism.contacts, found, strict=True):
        between = f"{contact.body_a} and {contact.body_b}"
        if each.gap < -TOUCHING:
            advice = f"they overlap by {-each.gap:.3g} m at the start; move one"
            raise InputError(f"pairs.{contact.name}", between, advice)
        closing = -float(each.normal @ each.slide)
        if each.gap <= TOUCHING and closing > still:
            advice = (
                f"they touch and approach at {closing:.3g} m/s, an impact at time 0; correct v0 or start them apart"
            )
            raise InputError(f"pairs.{contact.name}", between, advice)
