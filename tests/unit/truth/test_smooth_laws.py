"""Laws of smooth truths, which the check of the answer holds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.truth import truth_of_mechanism
from proofroll.truth.bodies import maximal_taylor
from proofroll.truth.plug_in import MechanismTruth
from proofroll.truth.smooth.smooth_truth import find_truth
from proofroll.truth.switching import contact_taylor

TIMES = np.array([0.0, 0.1, 0.2])
G = 9.81


def published(mechanism, times=TIMES):
    """Dataset of a truth."""
    return MechanismTruth.truth(MechanismElement(mechanism), times, ())


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("name", ["pendulum", "gear_pair", pytest.param("slider_crank", marks=pytest.mark.drill)])
def test_an_honest_truth_holds_the_laws(scene, name):
    """Joints, couplings, loops and motion hold at all samples, to the last time."""
    found = published(scene(name))
    assert found.attrs["laws"].endswith("laws at 3 of 3 samples")
    assert "ended" not in found.attrs


@pytest.mark.drill
def test_a_wrong_load_of_one_route_changes_its_energy(scene, monkeypatch):
    """Gravity that is wrong by a millionth in joint coordinates ends the truth, and the route is named."""
    for module in (maximal_taylor, contact_taylor):
        monkeypatch.setattr(module, "heyoka", None)
    begun = JointCoordinates.__init__

    def heavier(self, mechanism, rank=None):
        begun(self, mechanism, rank)
        self._gravity = 1.000001 * self._gravity

    mechanism = scene("double_pendulum")
    monkeypatch.setattr(JointCoordinates, "__init__", heavier)
    assert find_truth(mechanism, TIMES).ended.startswith("the route in joint coordinates changes the energy")


def test_a_wrong_load_of_both_routes_is_refused_from_the_start(scene, monkeypatch):
    """Gravity that both routes read wrong by a millionth breaks Newton's law with the scene's own."""
    mechanism = scene("double_pendulum")
    heavier = replace(mechanism, gravity=tuple(1.000001 * part for part in mechanism.gravity))
    monkeypatch.setattr(truth_of_mechanism, "_truth_of", lambda _, times: find_truth(heavier, times))
    with pytest.raises(Refused, match="mass times acceleration"):
        published(mechanism)


@pytest.mark.drill
def test_turns_of_a_fast_wheel_are_counted_in_each_route(scene):
    """A rotor that an elbow turns 50 times as fast holds the law of its gear in both routes, whole turns included."""
    found = published(scene("arm_rotor", elbow=0.8), np.array([0.0, 0.2, 0.4]))
    assert found.attrs["laws"].endswith("laws at 3 of 3 samples")


@pytest.mark.drill
def test_a_body_at_rest_beside_one_that_swings_holds_the_laws():
    """What round-off alone moves has no series that its points resolve; the laws hold of it as of the other body."""
    joints = tuple(
        Joint(name, "prismatic", "world", name, axis=(0, 0, 1), stiffness=100.0, q0=(start,))
        for name, start in (("rests", -G / 100.0), ("swings", 0.3))
    )
    mechanism = Mechanism(tuple(Body(joint.name, 1.0) for joint in joints), joints, gravity=(0, 0, -G))
    assert published(mechanism).attrs["laws"].endswith("laws at 3 of 3 samples")


@pytest.mark.drill
def test_a_mass_on_a_strut_is_known_however_far_its_samples_are_apart():
    """From one sample to the next the strut may turn so far that its rows do not tell a singular pose between."""
    angle, r = np.radians(80.0), 1.0
    half_period = 2 * np.sqrt(r / G) * ellipk(np.sin(angle / 2) ** 2)
    bodies = (Body("cart", 1e-3), Body("mass", 1.0))
    joints = (
        Joint("x", "prismatic", "world", "cart", axis=(1, 0, 0), q0=(r * np.sin(angle),)),
        Joint("z", "prismatic", "cart", "mass", axis=(0, 0, 1), q0=(-r * np.cos(angle),), dependent=True),
    )
    strut = Loop("strut", "distance", "world", "mass", length=r)
    mechanism = Mechanism(bodies, joints, loops=(strut,), gravity=(0, 0, -G))
    found = published(mechanism, np.array([0.0, half_period]))
    assert "ended" not in found.attrs
    assert found.attrs["laws"].endswith("laws at 2 of 2 samples")
