"""Contacts at the start: closed and standing by the scene's own size, whatever that is."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.start import check_contacts
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair


def door_and_ball(size: float, apart: float, *, gap: float = 0.0, speed: float = 0.0) -> Mechanism:
    """A door apart from its stop by an angle [rad], and a ball over a floor, at parts of their size [m] and speed."""
    moment = (1e-2 * size**2,) * 3
    height, down = (1 + gap) * size, -speed * float(np.sqrt(9.81 * size))
    joints = (
        Joint("hinge", "revolute", "world", "door", axis=(0, 1, 0), limits=(-apart, 1.0)),
        Joint("free", "free", "world", "ball", q0=(0, 0, height, 1, 0, 0, 0), v0=(0, 0, down, 0, 0, 0)),
    )
    return Mechanism(
        bodies=(Body("door", 1.0, (-size, 0, size), moment), Body("ball", 1.0, inertia=moment)),
        joints=joints,
        geometries=(Geometry("sphere", "ball", "sphere", radius=size), Geometry("floor", "world", "plane")),
        pairs=(Pair("sole", ("sphere", "floor"), friction=0.2),),
    )


@pytest.mark.parametrize("size", [1e-7, 1e-3, 1.0, 1e4])
def test_what_touches_at_the_start_is_a_part_of_the_size(size: float) -> None:
    """Gaps of a ten-billionth of the size are closed, of a millionth open; a joint is at its stop by rounding alone."""

    def kinds(mechanism: Mechanism) -> list[str]:
        mode, _ = ContactDynamics(mechanism).begin()
        return [own.kind for own in mode]

    assert kinds(door_and_ball(size, 1e-14, gap=1e-10)) == ["stick", "slip", "open"]
    assert kinds(door_and_ball(size, 1e-10, gap=1e-10)) == ["stick", "open", "open"]
    assert kinds(door_and_ball(size, 1e-6, gap=1e-6)) == ["open", "open", "open"]


@pytest.mark.parametrize("size", [1e-7, 1.0, 1e4])
@pytest.mark.parametrize(("gap", "speed", "said"), [(-1e-6, 0.0, "overlap"), (0.0, 1e-6, "approach")])
def test_what_overlaps_or_strikes_at_the_start_is_refused(size: float, gap: float, speed: float, said: str) -> None:
    """An overlap by a millionth of the size is refused, and so is a contact that closes as slowly as a part of it."""
    check_contacts(door_and_ball(size, 0.0, gap=gap / 1e4, speed=speed / 1e4))
    with pytest.raises(InputError, match=said):
        check_contacts(door_and_ball(size, 0.0, gap=gap, speed=speed))
