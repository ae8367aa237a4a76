"""Slips of contacts, located in the steps of the engines and not between samples."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

import proofroll
from proofroll.core.events import events_of
from proofroll.core.multi_element import watch_events
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Force, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build

STEP = 1e-3
ENGINES = [
    "mujoco[formulation=geoms,preset=tuned]",
    "mujoco[formulation=geoms,preset=matched]",
    "exudyn[formulation=spheres]",
    "pinocchio[formulation=impulses,preset=tuned]",
    "pinocchio[formulation=impulses,preset=matched]",
]


SLIPS = 0.176668  # s; of the ball, by its truth


def ball() -> tuple[Scene, tuple[float, ...]]:
    """A ball that rolls around in the cylinder with little friction, and the time at which it slips."""
    return load_scene("sphere_in_cylinder", speed=4, rolling_resistance=0, mu_static=0.15), (SLIPS,)


@pytest.mark.drill
def test_the_ball_slips_where_its_truth_says() -> None:
    """Both routes of the truth have the time that engines are held to."""
    (slip,) = events_of(proofroll.simulate(ball()[0], "truth", until=0.2, every=0.02))
    assert slip.time == pytest.approx(SLIPS, abs=1e-6)


MASS, FRICTION = 10.0, 0.4  # of the sled [kg]


def sled(push: str) -> Scene:
    """A sled on three feet of unequal loads with a ``push`` [N]."""
    feet = ((0.15, 0.1), (0.15, -0.1), (-0.2, 0.0))
    spheres = [Geometry(f"foot{k}", "sled", "sphere", (*place, -0.08), radius=0.02) for k, place in enumerate(feet)]
    mechanism = Mechanism(
        (Body("sled", MASS, inertia=(0.1, 0.2, 0.3)),),
        (Joint("free", "free", "world", "sled", q0=(0, 0, 0.1, 1, 0, 0, 0)),),
        geometries=(Geometry("floor", "world", "plane"), *spheres),
        pairs=tuple(Pair(sphere.name, (sphere.name, "floor"), FRICTION) for sphere in spheres),
        forces=(Force("push", "sled", "force", (Formula(push), 0.0, 0.0)),),
    )
    return Scene("pushed_sled", "", (MechanismElement(mechanism),))


def growing_push() -> tuple[Scene, tuple[float, ...]]:
    """A sled whose push grows, and the time at which it overcomes all friction."""
    return sled("800*t"), (FRICTION * MASS * 9.81 / 800,) * 3


@pytest.mark.one_in(3)
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("moving", [ball, growing_push])
def test_a_slip_is_located_within_two_steps(moving: Callable[[], tuple[Scene, tuple[float, ...]]], engine: str) -> None:
    """A ball that loses its grip and a sled that begins to move do so where the truth has it, by samples of 20 ms."""
    scene, times = moving()
    until = math.ceil(times[0] / 0.02) * 0.02
    events = events_of(proofroll.simulate(scene, engine, until=until, every=0.02))
    assert [event.kind for event in events] == ["slip"] * len(times)
    assert [event.time for event in events] == pytest.approx(times, abs=2 * STEP)
    assert max(event.time_high - event.time_low for event in events) <= 2 * STEP * (1 + 1e-9)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_slip_between_two_samples_is_seen(engine: str) -> None:
    """A gentle push moves the sled and friction stops it, both between the same two samples."""
    peak, centre, width, held = 42.0, 0.15, 0.05, FRICTION * MASS * 9.81
    start = centre - width * math.sqrt(math.log(peak / held))

    def gained(time: float) -> float:
        """Momentum of the sled in parts of its largest friction [s]."""
        push = peak * width * math.sqrt(math.pi) / 2 / held
        return push * (math.erf((time - centre) / width) - math.erf((start - centre) / width)) - (time - start)

    stop = brentq(gained, centre, 0.3)
    scene = sled(f"{peak}*exp(-((t - {centre})/{width})**2)")
    events = events_of(proofroll.simulate(scene, engine, until=0.3, every=0.1))
    assert [event.kind for event in events] == ["slip"] * 3 + ["stick"] * 3
    assert [event.time for event in events] == pytest.approx([start] * 3 + [stop] * 3, abs=2 * STEP)


@pytest.mark.one_in(3)
@pytest.mark.parametrize("engine", ENGINES)
def test_unbounded_friction_never_slips(engine: str) -> None:
    """A ball that rolls in the cylinder creeps in steps of first order, and has no event."""
    scene = load_scene("sphere_in_cylinder", speed=4, rolling_resistance=0)
    assert events_of(proofroll.simulate(scene, engine, until=0.1, every=0.02)) == []


@pytest.mark.parametrize("engine", ["mujoco[formulation=geoms]", "exudyn[formulation=spheres]"])
def test_steps_are_the_same_whether_events_are_looked_for(engine: str) -> None:
    """A run that only advances has no events, and ends in the same state, to the bit, as one that looks for them."""
    plain, watched = (build(growing_push()[0], engine) for _ in range(2))
    watch_events(watched)
    for t in (0.04, 0.08):
        plain.advance(t)
        watched.advance(t)
    assert plain.events() is None
    assert watched.events()
    for name in ("p_WB", "q_WB", "v_WB", "w_WB"):
        np.testing.assert_array_equal(getattr(plain.sample(), name), getattr(watched.sample(), name))
