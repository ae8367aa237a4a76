"""A law of joints or contacts that an engine provides changes its motion as it must."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import pytest
from single_precision import Single

from proofroll.conformance import checks
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.engines.mujoco import Mujoco

LAWS = frozenset(
    MechanismCapability[name]
    for name in ("JOINT_SPRINGS", "ARMATURE", "JOINT_FRICTION", "ACTUATORS", "SATURATION", "COUPLINGS", "SIGNALS")
)
OF_CONTACTS = ("CONTACT", "SPHERES", "PLANES", "CONTACT_FRICTION", "CONTACT_REBOUNDS", "REVOLUTE", "FREE")
CONTACTS = frozenset(MechanismCapability[name] for name in OF_CONTACTS)

DRIVES = ("servo", "limit", "target", "coupling")


class Deaf(Single):
    """Says that its joints have laws, and leaves them all out."""

    provides: ClassVar[Mapping[str, frozenset[str]]] = {name: LAWS | can for name, can in Single.provides.items()}


class Untouched(Single):
    """Says that bodies touch, in a formulation of its own, and lets them pass through each other."""

    provides: ClassVar[Mapping[str, frozenset[str]]] = {**Single.provides, "rk4": CONTACTS}
    made_for: ClassVar[Mapping[str, frozenset[str]]] = {"rk4": frozenset({MechanismCapability.CONTACT})}


class Smooth(Mujoco):
    """Leaves friction out of its contacts."""

    without: ClassVar[str] = "friction"

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Any:
        """The scene without that law of its pairs."""
        (element,) = scene.elements
        assert isinstance(element, MechanismElement)
        law: dict[str, Any] = {cls.without: 0.0}
        pairs = tuple(replace(pair, **law) for pair in element.mechanism.pairs)
        changed = replace(element, mechanism=replace(element.mechanism, pairs=pairs))
        return Mujoco.build(replace(scene, elements=(changed,)), settings)


class Dull(Smooth):
    """Leaves restitution out of them."""

    without: ClassVar[str] = "restitution"


@pytest.mark.parametrize(
    ("engine", "where"),
    [
        (Untouched, "rk4-matched-sled"),
        pytest.param(Smooth, "geoms-tuned-sled", marks=pytest.mark.drill),
        pytest.param(Smooth, "geoms-matched-two_spheres", marks=pytest.mark.drill),
        (Dull, "geoms-matched-two_spheres"),
    ],
)
def test_contacts_that_are_left_out_are_noticed(engine: type[Any], where: str) -> None:
    """An engine whose bodies pass through each other, or touch by half of the law, fails the check of its motion."""
    (own,) = [check for check in checks(engine) if check.name == f"moves_as_the_truth[{where}]"]
    with pytest.raises(AssertionError, match="is off by"):
        own.run()


def test_formulations_are_checked_on_what_they_are_made_for() -> None:
    """A formulation for contact is checked where bodies touch, and on no other scene; another one where they do not."""
    scenes = {check.name.rpartition("-")[2] for check in checks(Untouched) if "[rk4-matched-" in check.name}
    assert scenes == {"sled]", "two_spheres]", "restitution]", "friction_of_contacts]"}
    assert not any("sled" in check.name for check in checks(Single))


@pytest.mark.drill
@pytest.mark.parametrize(
    "law",
    [
        "damping",
        *(pytest.param(law, marks=pytest.mark.nightly) for law in ("armature", "torque", "friction", *DRIVES)),
    ],
)
def test_a_law_that_is_left_out_is_noticed(law: str) -> None:
    """An engine that says it has a law, and moves without it, fails the checks of its motion."""
    ending = f"[rk4-matched-double_pendulum-{law}]"
    own = [check for check in checks(Deaf) if check.name.endswith(ending) and check.name.startswith(("first", "moves"))]
    assert len(own) == 2
    for check in own:
        with pytest.raises(AssertionError):
            check.run()


def test_who_has_no_laws_is_not_asked() -> None:
    """An engine that provides no laws of joints has no check of them."""
    assert not any("double_pendulum-" in check.name for check in checks(Single))
