"""A law of joints that an engine provides changes its motion as it must."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import pytest
from single_precision import Single

from proofroll.conformance import checks
from proofroll.elements.mechanism.capabilities import MechanismCapability

LAWS = frozenset(
    MechanismCapability[name]
    for name in ("JOINT_SPRINGS", "ARMATURE", "JOINT_FRICTION", "ACTUATORS", "SATURATION", "COUPLINGS", "SIGNALS")
)

DRIVES = ("servo", "limit", "target", "coupling")


class Deaf(Single):
    """Says that its joints have laws, and leaves them all out."""

    provides: ClassVar[Mapping[str, frozenset[str]]] = {name: LAWS | can for name, can in Single.provides.items()}


@pytest.mark.parametrize(
    "law",
    ["damping", "armature", *(pytest.param(law, marks=pytest.mark.drill) for law in ["torque", "friction", *DRIVES])],
)
def test_a_law_that_is_left_out_is_noticed(law: str) -> None:
    """An engine that says it has a law, and moves without it, fails the checks of its motion."""
    ending = f"[rk4-matched-double_pendulum-{law}]"
    own = [check for check in checks(Deaf) if check.name.endswith(ending) and check.name.startswith(("first", "moves"))]
    assert len(own) == 2
    for check in own:
        with pytest.raises(AssertionError):
            check()


def test_who_has_no_laws_is_not_asked() -> None:
    """An engine that provides no laws of joints has no check of them."""
    assert not any("double_pendulum-" in check.name for check in checks(Single))
