"""What engines and mechanisms say to each other."""

from types import SimpleNamespace

import mechanism_examples as examples
import numpy as np
import pytest

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.capabilities import ALL_SHAPES, MechanismCapability, require, required
from proofroll.elements.mechanism.run.sampling import mechanism_of, row_rank


def wheel(**law):
    """A wheel on an axle."""
    joint = Joint("axle", "revolute", "world", "wheel", **law)
    return Mechanism((Body("wheel", 1.0, inertia=(0.1, 0.1, 0.2)),), (joint,))


def test_a_mechanism_requires_what_it_holds_and_no_more():
    """Each kind of joint and loop, springs, and each law of a joint asks for its own capability."""
    assert required(wheel()) == {MechanismCapability.REVOLUTE}
    laws = {"damping": "JOINT_SPRINGS", "torque": "JOINT_SPRINGS", "friction": "JOINT_FRICTION", "armature": "ARMATURE"}
    for law, capability in laws.items():
        assert required(wheel(**{law: 1.0})) == {MechanismCapability.REVOLUTE, MechanismCapability[capability]}
    every = required(examples.every_kind())
    stops = {"limits": (-1.0, 1.0)}
    assert required(wheel(**stops)) == {MechanismCapability.REVOLUTE, MechanismCapability.STOPS}
    assert MechanismCapability.REBOUNDS in required(wheel(**stops, restitution=0.5))
    of_contact = {"CONTACT", "CONTACT_FRICTION", "UNBOUNDED_FRICTION", "STATIC_FRICTION"}
    of_contact |= {"CONTACT_REBOUNDS", "SLIP_REBOUNDS", "TURNING_FRICTION", "SHARED_CONE"}
    of_contact |= {item.name for item in ALL_SHAPES}
    of_drives = {"ACTUATORS", "SATURATION", "COUPLINGS", "COUPLINGS_OF_MANY", "MASSLESS", "SIGNALS", "HELD", "MOTIONS"}
    assert of_contact | of_drives | {
        "JOINT_SPRINGS",
        "DISTANCE_LOOP",
        "SPRING_LAWS",
        "JOINT_FRICTION",
        "ARMATURE",
        "REDUNDANT",
        "STOPS",
        "REBOUNDS",
        "ORIENTATION",
    } == {item.name for item in set(MechanismCapability) - every}


def test_what_is_lacking_is_named_with_its_reason():
    """A refusal names everything that is lacking, each with its reason where there is one."""
    mechanism = wheel(friction=1.0, armature=1.0)
    with pytest.raises(Refused) as caught:
        require(mechanism, {MechanismCapability.REVOLUTE}, {MechanismCapability.ARMATURE: "there are no drives"})
    assert str(caught.value) == "needs dry friction in joints, inertia of drives, and there are no drives"
    require(mechanism, set(MechanismCapability), {})


def test_the_mechanism_of_a_scene_is_its_only_element():
    """A scene of one mechanism gives it; anything else, alone or besides, is refused."""
    mechanism = wheel()
    holding, other = SimpleNamespace(mechanism=mechanism), SimpleNamespace()
    assert mechanism_of(mechanism) is mechanism
    assert mechanism_of(SimpleNamespace(elements=(holding,))) is mechanism
    for elements in ((other,), (holding, other), (holding, holding)):
        with pytest.raises(Refused, match="a scene of one mechanism"):
            mechanism_of(SimpleNamespace(elements=elements))


def test_rows_of_any_size_count_alike():
    """The number of independent rows does not depend on the units in which each is written."""
    rows = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 1.0], [1.0, 3.0, 1.0], [0.0, 0.0, 0.0]])
    assert row_rank(rows) == 2
    assert row_rank(np.array([[1e-5], [1.0], [1e5], [1.0]]) * rows) == 2
    assert row_rank(np.zeros((0, 3))) == 0


def test_rows_of_round_off_do_not_count():
    """A row that cancellation leaves of zero is no constraint, whatever its direction."""
    rows = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 1.0], [8e-36, 0.0, 3e-36], [1e-16, 0.0, 0.0]])
    assert row_rank(rows) == 2
    assert row_rank(np.zeros((2, 3))) == 0
