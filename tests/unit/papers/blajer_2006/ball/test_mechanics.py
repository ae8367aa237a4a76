from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.contacts.on_wall import energy, resistance_moment, slip_velocity
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.mechanics import initial_response, newton_euler
from proofroll.papers.blajer_2006.ball.rolling_equations import placed, reduced_rates

G = 9.81


def test_slip_in_the_local_frame() -> None:
    """On the cylinder the slip is cγ̇ + aω3 along e2 and ż - aω2 along e3."""
    a, e1 = 0.025, np.array([1.0, 0, 0])
    assert slip_velocity(a, e1, np.array([0, 4.0, 0.5]), np.array([7.0, 3, 2])) == pytest.approx(
        [0, 4 + a * 2, 0.5 - a * 3], abs=1e-15
    )


def test_resistance_in_the_local_frame() -> None:
    """The moment of the rolling resistance is -N f ż/V about e2 and N f cγ̇/V about e3."""
    moment = resistance_moment(5e-4, 40.0, np.array([1.0, 0, 0]), np.array([0, 3.0, 4.0]))
    assert moment == pytest.approx([0, -40 * 5e-4 * 0.8, 40 * 5e-4 * 0.6], abs=1e-16)


def test_resistance_takes_power() -> None:
    """On a rolling ball the moment of the resistance does the work -N f V / a per second."""
    body = rolling_ball(load_scene("sphere_in_cylinder", axial_speed=1.5, radial_spin=9.0))
    moment = resistance_moment(5e-4, 30.0, body.surface.normal(body.p0), body.v0)
    assert moment @ body.w0 == pytest.approx(-30 * 5e-4 * np.hypot(4, 1.5) / 0.025, rel=1e-13)


def test_no_resistance_at_rest() -> None:
    """At rest the direction of rolling does not exist and the moment is zero, not NaN."""
    assert resistance_moment(5e-4, 40.0, np.array([1.0, 0, 0]), np.zeros(3)).tolist() == [0, 0, 0]


def test_resistance_over_time() -> None:
    """The moment of many states is that of each alone."""
    rng = np.random.default_rng(3)
    N, e1, v = rng.uniform(1, 2, 4), rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
    alone = [resistance_moment(1e-3, N[i], e1[i], v[i]) for i in range(4)]
    assert resistance_moment(1e-3, N, e1, v) == pytest.approx(np.array(alone), abs=1e-18)


def test_energy() -> None:
    """Energy is ½mv² + ½Jω² + mgz."""
    body = rolling_ball(load_scene("sphere_in_cylinder"))
    m, J = body.ball.mass, body.ball.inertia
    found = energy(body, np.array([0.2, 0, 3.0]), np.array([0, 4.0, 0]), np.array([0, 0, -160.0]))
    assert found == pytest.approx(0.5 * m * 16 + 0.5 * J * 160**2 + m * G * 3, rel=1e-15)


def test_initial_response_of_the_paper_case() -> None:
    """At time 0 the paper's ball feels N = m V0²/c, F3 = (2/7) m g and falls with (5/7) g."""
    acceleration, force = initial_response(rolling_ball(load_scene("sphere_in_cylinder")))
    assert acceleration == pytest.approx([-(4**2) / 0.2, 0, -5 / 7 * G], rel=1e-13, abs=1e-13)
    assert force == pytest.approx([-0.517 * 16 / 0.2, 0, 2 / 7 * 0.517 * G], rel=1e-13, abs=1e-13)


def test_initial_response_with_resistance_and_spin() -> None:
    """With spin and resistance the initial accelerations are those of the reduced equations."""
    f, a, c, speed, axial, spin = 5e-4, 0.025, 0.2, 3.3, 0.7, 12.0
    scene = load_scene("sphere_in_cylinder", speed=speed, axial_speed=axial, radial_spin=spin, rolling_resistance=f)
    acceleration, _ = initial_response(rolling_ball(scene))
    rate = speed / c
    k = 5 / 7 * f / a * c * rate**2 / np.hypot(speed, axial)
    expected = [-c * rate**2, -k * c * rate, -5 / 7 * G - 2 / 7 * a * rate * spin - k * axial]
    assert acceleration == pytest.approx(expected, rel=1e-12)


def test_newton_euler_obeys_its_equations(scene: Scene) -> None:
    """The solution satisfies Newton, Euler with the resistance, and keeps the contact point at rest."""
    body = rolling_ball(scene)
    acceleration, w_rate, force = newton_euler(body, body.p0, body.v0, body.w0)
    a, m, J, f = body.ball.radius, body.ball.mass, body.ball.inertia, body.contact.rolling_resistance
    e1 = body.surface.normal(body.p0)
    N = -force @ e1
    assert m * acceleration == pytest.approx(m * body.gravity + force, abs=1e-12)
    moment = np.cross(a * e1, force) + resistance_moment(f, N, e1, body.v0)
    assert J * w_rate == pytest.approx(moment, abs=1e-12)
    h = 1e-6
    states = [
        (body.p0 + s * h * body.v0, body.v0 + s * h * acceleration, body.w0 + s * h * w_rate) for s in (-1.0, 1.0)
    ]
    before, after = (slip_velocity(a, body.surface.normal(p), v, w) for p, v, w in states)
    assert (after - before) / (2 * h) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("ratio", [0.4, 2 / 3])
@pytest.mark.parametrize("f", [0.0, 5e-4])
def test_reduced_equations_are_those_of_newton_and_euler(f: float, ratio: float) -> None:
    """At random states, force and accelerations with the reactions eliminated are those of the nine equations."""
    rng = np.random.default_rng(5)
    paper = rolling_ball(load_scene("sphere_in_cylinder", rolling_resistance=f))
    body = replace(paper, ball=replace(paper.ball, inertia_ratio=ratio))
    for state in rng.uniform(-1, 1, (10, 5)) * [3.0, 1.0, 20.0, 3.0, 40.0]:
        rates, v, reduced_force = reduced_rates(body, state)
        p, _, w = (values[0] for values in placed(body, state[None], v[None]))
        acceleration, w_rate, force = newton_euler(body, p, v, w)
        assert reduced_force == pytest.approx(force, abs=1e-12)
        bent = body.surface.second(state[:2]) @ state[2:4] @ state[2:4]
        assert body.surface.tangents(state[:2]) @ rates[2:4] + bent == pytest.approx(acceleration, abs=1e-11)
        e1 = body.surface.normal(p)
        spin_rate = w_rate @ e1 + w @ (body.surface.normal_gradient(p) @ v)
        assert rates[4] == pytest.approx(spin_rate, abs=1e-9)
