"""Rolling inside a tilted cylinder: a pendulum around the axis, and along it a linear equation that turns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from proofroll.core.events import events_of
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene

G, A, C = 9.81, 0.025, 0.2


@pytest.mark.nightly
@settings(max_examples=8, deadline=None)
@given(
    tilt=st.floats(0.05, 1.55),
    k=st.floats(0.1, 1),
    axial=st.floats(-1, 1),
    spin=st.floats(-40, 40),
)
def test_quadrature(tilt: float, k: float, axial: float, spin: float) -> None:
    """With w = ż + i λ a ω1 and λ² = k/(1 + k), ẇ = i λ γ̇ w - g cos α/(1 + k), while γ swings as a pendulum."""
    across, along, turn = G * np.sin(tilt) / (1 + k), G * np.cos(tilt) / (1 + k), np.sqrt(k / (1 + k))
    speed = 1.2 * np.sqrt((G * np.sin(tilt) * C) * (1 + 4 / (1 + k)) + 0.1)
    scene = load_scene("tilted_cylinder", tilt=tilt, inertia_ratio=k, speed=speed, axial_speed=axial, radial_spin=spin)
    found = truth(scene, np.linspace(0, 0.3, 4))

    swing = solve_ivp(
        lambda _, y: [y[1], -across / C * np.sin(y[0])],
        (0, 0.3),
        [0.0, speed / C],
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
        dense_output=True,
    )
    times = found["time"].to_numpy()
    gamma, rate = swing.sol(times)
    parts = [
        [quad(lambda t, p=part: p(np.exp(-1j * turn * swing.sol(t)[0])), 0, end, epsabs=1e-13)[0] for end in times]
        for part in (np.real, np.imag)
    ]
    w = np.exp(1j * turn * gamma) * (
        axial + 1j * turn * A * spin - along * (np.array(parts[0]) + 1j * np.array(parts[1]))
    )
    np.testing.assert_allclose(found["gamma"], gamma, rtol=0, atol=1e-10)
    np.testing.assert_allclose(found["z_rate"], np.real(w), rtol=0, atol=1e-10)
    np.testing.assert_allclose(found["omega1"], np.imag(w) / (turn * A), rtol=0, atol=1e-7)
    press = 0.517 * (C * rate**2 + G * np.sin(tilt) * np.cos(gamma))
    np.testing.assert_allclose(found["N"], press, rtol=1e-9)


@pytest.mark.nightly_of("0.4-2.2")
@pytest.mark.nightly
@pytest.mark.parametrize(("k", "speed"), [(0.4, 2.2), pytest.param(2 / 3, 2.1, marks=pytest.mark.drill)])
def test_where_it_leaves_the_wall(k: float, speed: float) -> None:
    """Energy says at which angle: cos γ = -(V0²(1 + k) - 2 g' c) / (g' c (3 + k)) with g' = g sin α."""
    pull = G * np.sin(0.9) * C
    found = truth(load_scene("tilted_cylinder", speed=speed, inertia_ratio=k), np.linspace(0, 0.4, 401))
    (event,) = events_of(found)
    assert event.kind == "lift_off"
    at = float(np.interp(event.time, found["time"], found["gamma"]))
    assert np.cos(at) == pytest.approx(-(speed**2 * (1 + k) - 2 * pull) / (pull * (3 + k)), abs=1e-5)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(("part", "leaves"), [(0.995, True), (1.005, False)])
def test_speed_that_it_takes_round_a_lying_cylinder(part: float, leaves: bool) -> None:
    """A homogeneous ball from the bottom of a lying cylinder stays on the wall from V0² = 27 g c/7 on."""
    scene = load_scene("tilted_cylinder", tilt=np.pi / 2, speed=part * np.sqrt(27 * G * C / 7))
    found = truth(scene, np.linspace(0, 0.36, 61))
    assert [event.kind for event in events_of(found)] == (["lift_off"] if leaves else [])
    assert float(np.abs(np.unwrap(found["gamma"])[-1])) > (2.8 if leaves else np.pi)
