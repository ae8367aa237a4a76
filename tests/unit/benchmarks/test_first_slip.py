"""Compiled first slips, one at a time and in bulk, against the truth's curve of needed friction."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from proofroll.core import heyoka_library as library
from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Missing, Refused
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.truth.friction_curve import friction_curve
from proofroll.papers.blajer_2006.truth.onset import first_slip as true_first_slip
from proofroll.papers.blajer_2006.truth.polar import Polar
from proofroll_benchmarks.first_slip import FirstSlip, first_slip
from proofroll_benchmarks.first_slips import first_slips

pytestmark = pytest.mark.skipif(not library.available(), reason="heyoka is not installed")

UNTIL = 4.0
# Blajer's case: first slip 1.720183172 s.
PAPER = load_scene("sphere_in_cylinder", rolling_resistance=5e-4, mu_static=0.35)


def cylinder(**parameters: float) -> Scene:
    """The sphere in the cylinder."""
    return load_scene("sphere_in_cylinder", **parameters)


def true_time(scene: Scene) -> float:
    """The truth's first slip [s]; NaN: not until the end."""
    found = true_first_slip(rolling_ball(scene), UNTIL)
    return np.nan if found is None else found


def random_balls(count: int) -> dict[str, FloatArray]:
    """Speeds, frictions and resistances (a third of them zero) around those of the paper."""
    random = np.random.default_rng(7)
    f = np.where(np.arange(count) % 3 == 0, 0.0, random.uniform(0, 7.5e-4, count))
    return {"v2": random.uniform(-6, 6, count), "mu": random.uniform(0.05, 0.6, count), "f": f}


@pytest.mark.nightly_of("euler")
@pytest.mark.parametrize("model", ["reduced", "rotating_frame", "euler"])
def test_the_papers_case(model: Any) -> None:
    """Every model finds the paper's first slip, and the place where it happens."""
    run = FirstSlip(rolling_ball(PAPER), model)
    assert run.run(UNTIL) == pytest.approx(1.720183172, abs=1e-9)  # by their last digits, here and below
    assert run.p_WB[2] == pytest.approx(-0.15342234, abs=1e-8)
    assert run.run(1.72) is None
    assert run.run(UNTIL) == pytest.approx(true_time(PAPER), abs=1e-12)


@pytest.mark.nightly
def test_random_balls_against_the_truth() -> None:
    """Forty balls slip when the truth says, within 1e-10 s, and never where it says never."""
    balls = random_balls(40)
    found = first_slips(PAPER, UNTIL, **balls)
    expected = np.array(
        [
            true_time(cylinder(speed=v2, mu_static=mu, rolling_resistance=f))
            for v2, mu, f in zip(*(balls[key].tolist() for key in ("v2", "mu", "f")), strict=True)
        ]
    )
    assert np.array_equal(np.isnan(found), np.isnan(expected))
    assert 2 < np.sum(np.isnan(found)) < 38
    assert np.sum(found == 0) > 1  # at once
    assert np.nanmax(np.abs(found - expected)) < 1e-10


@pytest.mark.nightly
def test_random_balls_against_the_other_route(monkeypatch: pytest.MonkeyPatch) -> None:
    """A route that shares no equations with the compiled ones, nor heyoka, finds the same times."""
    balls = random_balls(4)
    found = first_slips(PAPER, 1.0, **balls)
    monkeypatch.setattr("proofroll.papers.blajer_2006.truth.friction_curve.first_route", Polar)
    for index, time in enumerate(found):
        v2, mu, f = (float(balls[key][index]) for key in ("v2", "mu", "f"))
        expected = true_first_slip(rolling_ball(cylinder(speed=v2, mu_static=mu, rolling_resistance=f)), 1.0)
        assert time == pytest.approx(np.nan if expected is None else expected, abs=1e-10, nan_ok=True)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("distance", [1e-6, 1e-9])  # the truth has its crests to some 1e-10
@pytest.mark.parametrize("f", [0.0, 3e-4, 5e-4])
def test_on_either_side_of_every_stair(f: float, distance: float) -> None:
    """With μ just below a crest the ball slips on that crest, with μ just above it on a later one or never."""
    curve = friction_curve(rolling_ball(cylinder(speed=4.0, rolling_resistance=f)), UNTIL)
    edges = curve.edges()
    assert len(edges) >= 1
    crests = np.array([curve.crest_times[np.argmin(np.abs(curve.crest_values - edge))] for edge in edges])
    # near a crest n = edge - n''/2 (t - t_crest)², so μ = edge (1 - d) is reached at about √d before it
    below = first_slips(PAPER, UNTIL, v2=4.0, f=f, mu=edges * (1 - distance))
    above = first_slips(PAPER, UNTIL, v2=4.0, f=f, mu=edges * (1 + distance))
    assert np.all(np.abs(below - crests) < 2 * np.sqrt(distance))
    assert np.all((above > crests + 0.05) | np.isnan(above))
    single = [first_slip(cylinder(speed=4.0, rolling_resistance=f, mu_static=mu), UNTIL) for mu in edges * (1 - 1e-9)]
    assert np.allclose(first_slips(PAPER, UNTIL, v2=4.0, f=f, mu=edges * (1 - 1e-9)), single, rtol=0, atol=1e-10)


@pytest.mark.parametrize("speed", [3.1, 4.0, 5.3])
def test_a_crest_that_grazes_mu(speed: float) -> None:
    """Without resistance the crest is (12/7) g c/V0²: μ less by one part in 1e14 is reached, and just there."""
    crest = 12 / 7 * 9.81 * 0.2 / speed**2
    found = first_slips(PAPER, UNTIL, v2=speed, f=0.0, mu=crest * (1 + np.array([-1e-6, -1e-10, -1e-14, 1e-14, 1e-10])))
    half_turn = np.pi / (np.sqrt(2 / 7) * speed / 0.2)
    assert np.allclose(found[:3], half_turn, rtol=0, atol=2e-3 * half_turn)
    assert half_turn - found[2] < 1e-6
    assert np.isnan(found[3:]).all()


def test_closed_form_of_the_time() -> None:
    """Without resistance the first slip is where cos νt = (7/5)(1 - μ V0²/(g c)), at random speeds and frictions."""
    random = np.random.default_rng(3)
    v2, mu = random.uniform(1.5, 5, 400), random.uniform(0.1, 0.6, 400)
    cosine = 7 / 5 * (1 - mu * v2**2 / (9.81 * 0.2))
    with np.errstate(invalid="ignore"):
        expected = np.arccos(cosine) / (np.sqrt(2 / 7) * v2 / 0.2)
    expected[cosine > 1] = 0.0
    found = first_slips(PAPER, UNTIL, v2=v2, mu=mu, f=0.0)
    assert np.array_equal(np.isnan(found), cosine < -1)
    assert np.nanmax(np.abs(found - expected)) < 1e-10


def test_slip_at_time_zero() -> None:
    """A ball that needs more friction than there is slips at 0; one that just has it, when the need begins to rise."""
    needed = 2 / 7 * 9.81 * 0.2 / 4.0**2  # at the start, from where it rises
    found = first_slips(cylinder(), UNTIL, v2=4.0, f=0.0, mu=[0.5 * needed, needed, 1.01 * needed])
    assert found[0] == 0.0
    assert 0.0 <= found[1] < 1e-8  # it rises like t²
    assert 0.001 < found[2] < 0.1
    assert first_slip(cylinder(mu_static=0.5 * needed), UNTIL) == 0.0


def test_unbounded_friction_and_no_time() -> None:
    """Unbounded friction never slips, and nothing but a slip at once happens in no time."""
    assert np.isnan(first_slips(cylinder(), UNTIL, v2=[4.0, 2.0], f=0.0, mu=np.inf)).all()
    assert first_slip(cylinder(), UNTIL) is None
    found = first_slips(cylinder(), 0.0, v2=4.0, f=0.0, mu=[0.01, 0.35])
    assert found[0] == 0.0
    assert np.isnan(found[1])


def test_lanes_do_not_disturb_each_other() -> None:
    """The time of a ball does not depend on which balls roll beside it, nor on other threads."""
    balls = random_balls(100)
    alone = first_slips(PAPER, UNTIL, **balls)
    backwards = first_slips(PAPER, UNTIL, **{name: value[::-1] for name, value in balls.items()})[::-1]
    assert np.allclose(alone, backwards, rtol=0, atol=1e-12, equal_nan=True)
    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(lambda _: first_slips(PAPER, UNTIL, **balls), range(4)):
            assert np.array_equal(alone, found, equal_nan=True)


def test_a_ball_on_another_wall_is_refused() -> None:
    """Only a cylinder along whose axis gravity points is taken."""
    for name in ("inclined_plane", "tilted_cylinder"):
        scene = load_scene(name, mu_static=0.2)
        for call in (lambda: first_slip(scene, 1.0), lambda: first_slips(scene, 1.0, 4.0, 0.2, 1e-4)):  # noqa: B023 -- called at once
            with pytest.raises(Refused, match="represents one ball in an upright cylinder"):
                call()


def test_without_heyoka(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without heyoka the refusal names the extra."""
    monkeypatch.setattr(library, "available", lambda: False)
    for call in (lambda: first_slip(PAPER, UNTIL), lambda: first_slips(PAPER, UNTIL, 4.0, 0.35, 5e-4)):
        with pytest.raises(Missing, match=r"needs heyoka.*proofroll\[fast\]"):
            call()
