"""Law check of smooth truths."""

import numpy as np
import pytest

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.truth.bodies import maximal_taylor
from proofroll.truth.smooth_truth import find_truth
from proofroll.truth.switching import contact_taylor

TIMES = np.array([0.0, 0.1, 0.2])


@pytest.mark.parametrize("name", ["pendulum", "gear_pair", pytest.param("slider_crank", marks=pytest.mark.drill)])
def test_an_honest_truth_holds_the_laws(scene, name):
    """Joints, couplings, loops and motion hold to less than a tenth of their allowances."""
    found = find_truth(scene(name), TIMES)
    assert found.laws.startswith("holds ")
    assert float(found.laws.split("largest residual ")[1].split()[0]) < 0.1
    assert found.end == np.inf


def test_a_wrong_load_of_one_route_is_refused_from_the_start(scene, monkeypatch):
    """Gravity that is wrong by a millionth in joint coordinates breaks their law of motion, and theirs alone."""
    for module in (maximal_taylor, contact_taylor):
        monkeypatch.setattr(module, "heyoka", None)
    begun = JointCoordinates.__init__

    def heavier(self, mechanism, rank=None):
        begun(self, mechanism, rank)
        self._gravity = 1.000001 * self._gravity

    mechanism = scene("double_pendulum")
    monkeypatch.setattr(JointCoordinates, "__init__", heavier)
    with pytest.raises(Refused, match=r"one route \(joint coordinates\) breaks the law"):
        find_truth(mechanism, TIMES)


def test_turns_of_a_fast_wheel_are_counted_in_each_route(scene):
    """A rotor that an elbow turns 50 times as fast holds the law of its gear in both routes, whole turns included."""
    assert find_truth(scene("arm_rotor", elbow=0.8), np.array([0.0, 0.2, 0.4])).laws.startswith("holds ")
