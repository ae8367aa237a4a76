"""Truths of stiff mechanisms by implicit collocation."""

import numpy as np
import pytest

from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.files.scene_file import load_scene
from proofroll.truth.smooth.smooth_routes import stiff
from proofroll.truth.truth_of_mechanism import truth_of


@pytest.mark.drill
def test_a_stiff_servo_takes_few_rates(monkeypatch: pytest.MonkeyPatch) -> None:
    """A servo of 2000 time constants has the truth of its two exponentials, from few rates."""
    calls, rate = [], JointCoordinates.rate

    def counted(self: JointCoordinates, *given: object) -> object:
        calls.append(1)
        return rate(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(JointCoordinates, "rate", counted)
    kp, kd, times = 1e4, 1e5, np.array([0.0, 1e-4, 0.02])
    found = truth_of(the_mechanism(load_scene("servo", kp=kp, kd=kd)).mechanism, times)
    slow, fast = np.sort(np.abs(np.roots([1.0, kd, kp])))
    true = 1 - (fast * np.exp(-slow * times) - slow * np.exp(-fast * times)) / (fast - slow)
    assert found.record.q[:, 0] == pytest.approx(true, abs=1e-12)
    assert all(bar[-1] < 1e-9 for name, bar in found.bars.items() if name not in {"wrench", "named"})
    assert len(calls) < 8000


@pytest.mark.parametrize(("kd", "kp", "expected"), [(2e4, 1e4, True), (0.0, 1e8, False), (4.0, 100.0, False)])
def test_stiffness_is_measured(kd: float, kp: float, expected: bool) -> None:
    """A damper far faster than any swing is stiff; a fast swing is not, nor a servo that settles in the run's time."""
    mechanism = the_mechanism(load_scene("servo", kd=kd, kp=kp)).mechanism
    assert stiff(JointCoordinates(mechanism), 2.0) is expected
