import numpy as np
import pytest
from lone_routes import by_series
from scipy.integrate import solve_ivp

from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.witnesses.closed_forms import closed_form, swing


def test_four_bar_through_its_singular_poses(scene):
    """B0 after 10 s for one and two windows, as computed with 30 digits (elliptic functions)."""
    expected = {
        1: (0.478385057760971, 0.878150178791209),
        2: (0.328458111540815379, 0.944518538178600962),
    }
    for windows, (x, y) in expected.items():
        q = closed_form(scene("four_bar", windows=windows)).motion(np.array([10.0]))[0][0, 0]
        assert (-np.sin(q), np.cos(q)) == pytest.approx((x, y), abs=2e-13)


def test_pendulum_after_ten_seconds(scene):
    """The angle of 30 digits, to what doubles keep."""
    q, _ = closed_form(scene("pendulum")).motion(np.array([10.0]))
    assert q[0, 0] == pytest.approx(2.787822292713517, abs=3e-14)


def test_free_body_after_ten_seconds(scene):
    """The angular velocity of 30 digits; close to the separatrix, doubles keep 12 of them or 11."""
    w = closed_form(scene("free_body")).part(np.array([10.0]))[0]
    assert w == pytest.approx([-0.319760049443928713, 4.98977489580237640, 0.185603959386991289], abs=1e-11)


def test_heavy_top_after_five_seconds(scene):
    """The height of its centre of mass."""
    assert 0.3 * closed_form(scene("heavy_top")).part(np.array([5.0]))[0] == pytest.approx(0.238175298665333, abs=1e-12)


@pytest.mark.parametrize("angle", [0.3, -2.0, 7.0])
@pytest.mark.parametrize("speed", [0.0, 1.5, -1.5, 9.0, -9.0])
def test_swing_satisfies_its_equation(angle, speed):
    """Any start, swinging or turning over: the same as integrated numerically, and exactly the start at time 0."""
    times = np.linspace(0, 3, 7)
    angles, speeds = swing(angle, speed, 4.0, times)
    numeric = solve_ivp(
        lambda _, y: [y[1], -4 * np.sin(y[0])], (0, 3), [angle, speed], "DOP853", times, rtol=1e-12, atol=1e-12
    ).y
    assert angles[0] == pytest.approx(angle, abs=1e-13)
    assert np.abs(np.array([angles, speeds]) - numeric).max() < 1e-9


BODY = {"mass": 15, "height": 1, "transverse": 0.234375, "axial": 0.46875}
FAST_TOP = {**BODY, "tilt": -np.pi / 2, "sway": 4.61538, "spin": 150}  # Brüls and Cardona 2010
PARTS = [
    ("free_body", {"w1": 0.5, "w3": -0.2}),  # about the first axis
    ("free_body", {"w1": -0.2, "w2": -1.0, "w3": -0.7}),  # about the third
    ("heavy_top", {"sway": -3.0, "spin": 20.0}),
    ("heavy_top", FAST_TOP),
    ("oscillators", {"damping": 30.0}),  # overdamped
    ("oscillators", {}),
    ("pendulum", {"speed": -7.0}),
]


@pytest.mark.one_in(3)
@pytest.mark.parametrize(("name", "parameters"), PARTS)
def test_closed_forms_are_what_maximal_coordinates_find(scene, name, parameters):
    """A route that knows nothing of the closed form reaches the same."""
    pytest.importorskip("heyoka")
    mechanism = scene(name, **parameters)
    times = np.linspace(0, 1.5, 4)
    form, record = closed_form(mechanism), by_series(MaximalCoordinates(mechanism), times)
    difference = form.part(times) - form.same(record)
    if name == "pendulum":  # turns are lost in maximal coordinates
        difference -= 2 * np.pi * np.round(difference / (2 * np.pi))
    assert np.abs(difference).max() < 1e-12 * max(1.0, np.abs(form.part(times)).max())


@pytest.mark.parametrize("name", ["double_pendulum", "slider_crank", "bricard", "andrews_squeezer", "gyroscope_cart"])
def test_no_closed_form_is_claimed_for_others(scene, name):
    """None is recognised where none is known."""
    assert closed_form(scene(name)) is None
