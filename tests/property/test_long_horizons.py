"""What thousands of oscillations leave of the energy, of the constraints and of the phase."""

from __future__ import annotations

import copy
from decimal import Decimal, getcontext

import numpy as np
import pytest

from proofroll.core import heyoka_library as library
from proofroll.elements.mechanism.run.contacts.on_wall import energy
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.compiled import rolling
from proofroll.papers.blajer_2006.ball.rolling_equations import closed_form
from proofroll.running.simulation import build

needs_heyoka = pytest.mark.skipif(not library.available(), reason="heyoka is not installed")

SCENE = load_scene("sphere_in_cylinder", axial_speed=0.3, radial_spin=7.0)
BODY = rolling_ball(SCENE)
RATE = float(np.sqrt(2 / 7) * BODY.udot0[0])  # ν [rad/s]
PERIOD = 2 * np.pi / RATE
KINETIC = 0.7 * BODY.ball.mass * float(BODY.v0 @ BODY.v0)
EPS = float(np.finfo(float).eps)


def drift(engine: str, oscillations: int) -> tuple[float, float]:
    """Largest change of energy over the initial kinetic energy, and largest slip over the initial speed."""
    built = build(SCENE, engine)
    e1 = BODY.surface.normal
    changes, slips, first = [], [], None
    for part in range(11):
        built.advance(part * oscillations * PERIOD / 10)
        now = built.sample()
        level = float(energy(BODY, now.p_WB, now.v_WB, now.w_WB))
        first = level if first is None else first
        changes.append(abs(level - first) / KINETIC)
        slip = now.v_WB + BODY.ball.radius * np.cross(now.w_WB, e1(now.p_WB))
        slips.append(float(np.linalg.norm(slip)) / float(np.linalg.norm(BODY.v0)))
    return max(changes), max(slips)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.nightly_of("projection[formulation=euler,preset=tuned]-100")
@pytest.mark.parametrize(
    ("engine", "oscillations"),
    [
        pytest.param("projection[formulation=rotating_frame,preset=tuned]", 3000, marks=needs_heyoka),
        pytest.param("reduced[preset=tuned]", 3000, marks=needs_heyoka),
        # 35 s for 10,000, which leave 4e-13 of the energy and 3e-16 of slip; what grows with time shows in 100 as well
        pytest.param("projection[formulation=euler,preset=tuned]", 100, marks=[needs_heyoka, pytest.mark.drill]),
        pytest.param("projection[formulation=rotating_frame]", 100, marks=pytest.mark.drill),
        pytest.param("projection[formulation=euler]", 5, marks=pytest.mark.drill),
        ("reduced[formulation=closed_form,preset=matched]", 10_000),
    ],
)
def test_energy_and_constraints(engine: str, oscillations: int) -> None:
    """Without resistance the energy stays to 1e-11 of itself, and the contact point slips at round-off."""
    changed, slipped = drift(engine, oscillations)
    assert changed < 1e-11
    assert slipped < 1e-12


@pytest.mark.drill
@needs_heyoka
def test_angles_stay_within_a_turn() -> None:
    """However often the ball goes round, its angles keep all their digits: none grows beyond some turns."""
    built = build(SCENE, "projection[formulation=euler,preset=tuned]")
    built.advance(20 * PERIOD)
    angles = built._motion.x[built._angles]
    assert abs(float(BODY.udot0[0])) * 20 * PERIOD > 100
    # a step or four after the last look
    assert np.all(np.abs(angles) < 3 * 2 * np.pi)


@pytest.mark.nightly
@needs_heyoka
def test_without_elimination_round_off_adds_up() -> None:
    """What elimination is for: without it the same run ends with a slip hundreds of times as large."""
    engine = "projection[formulation=rotating_frame,preset=tuned]"
    with_it, without = drift(engine, 3000), drift(f"{engine[:-1]},elimination=false]", 3000)
    assert without[1] > 1e2 * with_it[1]
    assert without[0] > 1e2 * with_it[0]


@pytest.mark.drill
def test_without_elimination_a_coarse_step_adds_up() -> None:
    """With the classical method the Euler angles leave a violation at every step; elimination takes it away."""
    engine = "projection[formulation=euler,integrator=rk4,dt=1e-3]"
    step = PERIOD / 1000  # a whole number of steps to every sample
    engine = engine.replace("1e-3", repr(step))
    assert drift(engine, 2)[1] < 1e-13
    assert drift(f"{engine[:-1]},elimination=false]", 2)[1] > 1e-9


def test_phase_of_the_closed_form() -> None:
    """After a million oscillations z is as far from the exact value as round-off of νt lets it be, 4 ε νt."""
    body = rolling_ball(load_scene("sphere_in_cylinder"))
    getcontext().prec = 60
    # V0 = 4, and the c of the scene: the exact values of the numbers in double precision
    c, omega = Decimal(body.surface.length_scales[0]), Decimal(float(body.udot0[0]))
    rate = (Decimal(2) / 7).sqrt() * omega
    times = np.array([1.0, 1e3, 1e6]) * PERIOD * 1.1
    # π to 60 digits (DLMF 3.12.1)
    turn = 2 * Decimal("3.14159265358979323846264338327950288419716939937510582097494")
    phases = [rate * Decimal(float(t)) for t in times]
    exact = [-2.5 * 9.81 / float(omega) ** 2 * (1 - np.cos(float(phase % turn))) for phase in phases]
    found = closed_form(body, times)
    assert found is not None
    assert float(c) == pytest.approx(0.2)
    amplitude = 2.5 * 9.81 / float(omega) ** 2
    for z, wanted, phase in zip(found.p_WB[:, 2], exact, phases, strict=True):
        assert abs(z - wanted) < 4 * EPS * (1 + float(phase)) * amplitude


@needs_heyoka
def test_a_hundred_thousand_oscillations() -> None:
    """The reduced equations, compiled, keep the closed form's phase of z over so many oscillations: 16 ε νt.

    4 of that is the closed form's own round-off, the rest that of some three hundred thousand steps of the series.
    """
    body = rolling_ball(load_scene("sphere_in_cylinder"))
    model = rolling.reduced(resistance=False, tolerance=EPS)
    series = copy.copy(model.integrator)
    series.time, series.state[:] = 0.0, rolling.start(body)
    series.pars[:] = np.array(rolling.parameters(body)[: len(series.pars)])
    end = (1e5 + 0.25) * PERIOD
    series.propagate_until(end)
    found = closed_form(body, np.array([end]))
    assert found is not None
    amplitude = 2.5 * 9.81 / float(body.udot0[0]) ** 2
    assert abs(series.state[1] - found.p_WB[0, 2]) < 16 * EPS * RATE * end * amplitude
