"""Where the ball leaves the wall, a run is held against the truth as far as both go."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from proofroll import load_scene
from proofroll.core.dataset import observe, scales
from proofroll.core.events import Event, with_events
from proofroll.core.scene import Scene
from proofroll.core.time_grid import time_grid
from proofroll.core.truth import truth
from proofroll.elements.ball_on_surface.element import scene_with
from proofroll.running.recording import record
from proofroll.running.simulation import build
from proofroll.studies.judging.reference import Reference
from proofroll.studies.judging.run_values import observables_of

TIMES = time_grid(0.4, 5e-3)


def lying() -> Scene:
    """The paper's cylinder on its side; the ball leaves the wall at 0.27268 s."""
    scene = load_scene("sphere_in_cylinder", speed=2.7)
    return scene_with(scene, surface=replace(scene.elements[0].surface, tilt=math.pi / 2))


def reference(scene: Scene) -> Reference:
    """The truth of the scene."""
    dataset = truth(scene, TIMES)
    return Reference(scene, dataset, observe(scene, dataset), scales(scene, dataset))


@pytest.mark.parametrize("engine", ["reduced", "projection", "mujoco[formulation=chart]"])
def test_who_leaves_the_wall_is_judged_up_to_there(engine: str) -> None:
    """Every curve of a run that ends at lift-off, or that flies on, has a truth of its own length and agrees with it.

    The friction of rolling jumps to nothing at lift-off: one sample late would be an error as large as it.
    """
    if "mujoco" in engine:
        pytest.importorskip("mujoco")
    scene = lying()
    whole = reference(scene)
    run = record(build(scene, engine), scene, TIMES).dataset
    held, cut = whole.common_span({1.0: run})
    curves = observables_of(held, cut[1.0])
    for name in ("gamma", "z", "N", "F2", "F3", "gap", "slip", "event_times", "event_order"):
        true = held.true(name, curves[name]).values
        assert curves[name].shape == true.shape, name
        size = max(held.sizes.get(name, 1.0), 1e-9)  # nothing moves along the axis
        assert np.max(np.abs(curves[name] - true), initial=0.0) < 5e-3 * size, name
    assert (len(held.dataset.time) == len(TIMES)) == ("mujoco" in engine)
    assert held.dataset.gamma.attrs["error_bar"] == whole.dataset.gamma.attrs["error_bar"]


def test_who_ends_too_early_is_not_excused() -> None:
    """A run that ends well before the truth's ball leaves the wall stays too short to agree."""
    scene = lying()
    short = record(build(scene, "reduced"), scene, TIMES).dataset.isel(time=slice(30))
    held, cut = reference(scene).common_span({1.0: short})
    curve = observables_of(held, cut[1.0])["gamma"]
    assert curve.shape != held.true("gamma", curve).values.shape


@pytest.mark.parametrize("told", [0.0, 0.2, 0.272])
def test_a_lift_off_that_is_told_early_hides_no_force(told: float) -> None:
    """Forces are judged until the true lift-off, less two samples, whenever a run says that it leaves the wall."""
    scene = lying()
    run = record(build(scene, "reduced"), scene, TIMES).dataset
    run = with_events(run.assign(N=100 * run["N"]), [Event("lift_off", told, told, told)])
    held, cut = reference(scene).common_span({1.0: run})
    told_ones, pressed = observables_of(held, cut[1.0])["N"], held.curves["N"]  # from the first step on
    judged = held.dataset["time"].to_numpy()[-len(pressed) :] < 0.26
    assert np.all(pressed[judged] > 0)
    assert np.all(np.abs(told_ones - pressed)[judged] > 90 * pressed[judged])


def test_an_event_at_the_end_may_be_a_moment_later() -> None:
    """A run and a truth of which one has an event within its bracket of the end are judged alike; others count."""
    scene = load_scene("bouncing_ball", height=0.1, restitution=0.5, tangential_restitution=0.0)
    falls = math.sqrt(2 * 0.1 / 9.81)
    first, second = (falls, falls - 1e-4, falls), (2 * falls, 2 * falls - 1e-4, 2 * falls)

    def alike(after: float, *brackets: tuple[float, float, float]) -> int | None:
        """Number of events of a run to a time after the second impact [s] and of the truth; None: they differ."""
        dataset = truth(scene, np.linspace(0.0, 2 * falls + after, 41))
        whole = Reference(scene, dataset, observe(scene, dataset), scales(scene, dataset))
        assert [event.time for event in whole.events] == pytest.approx([falls, 2 * falls])
        run = with_events(dataset, [Event("bounce", *bracket) for bracket in brackets])
        held, cut = whole.common_span({1.0: run, 0.5: dataset})
        curve = observables_of(held, cut[1.0])["event_times"]
        return len(curve) if len(curve) == len(held.true("event_times", curve).values) else None

    assert alike(1e-6, first, second) == 2
    assert alike(1e-6, first) == 1  # its second may come a moment after the end
    assert alike(1e-6, (falls, falls, falls)) is None  # known to the last digit, it does not
    assert alike(1e-6) is None
    assert alike(0.1 * falls, (falls, 0.0, 2 * falls)) is None  # no bracket excuses what lies two samples before


def test_without_lift_off_nothing_changes() -> None:
    """Where the truth's ball stays on the wall, nothing is cut."""
    scene = load_scene("sphere_in_cylinder")
    whole = reference(scene)
    run = record(build(scene, "reduced"), scene, TIMES).dataset
    held, cut = whole.common_span({1.0: run})
    assert held is whole
    assert cut[1.0] is run


@pytest.mark.parametrize("other", [pytest.param("pendulum", marks=pytest.mark.drill), "inclined_plane", "faster"])
def test_a_ball_that_leaves_cuts_what_is_beside_it(other: str) -> None:
    """A run ends for all elements where one of them leaves the wall; all are judged up to there, also their events."""
    first = lying()
    ball = replace(first.elements[0].ball, name="second")
    if other == "faster":  # leaves the wall too, after the run has ended
        beside = scene_with(first, ball=ball, start=replace(first.elements[0].start, velocity=(2.72, 0.0)))
    else:
        beside = load_scene(other) if other == "pendulum" else scene_with(load_scene(other), ball=ball)
    scene = replace(first, elements=(first.elements[0], beside.elements[0]))
    whole = reference(scene)
    assert ("lift_off" in whole.dataset.get("event_kind.second", [])) == (other == "faster")
    run = record(build(scene, "projection"), scene, TIMES).dataset
    held, cut = whole.common_span({1.0: run})
    assert len(held.dataset.time) == len(run.time) < len(TIMES)
    curves = observables_of(held, cut[1.0])
    judged = {"gamma", "z", "N", "F2", "F3", "event_times", "event_order", "down", "across", "q", "tip"}
    for name in [name for name in curves if name.split(".")[0] in judged]:
        true = held.true(name, curves[name]).values
        assert curves[name].shape == true.shape, name
        size = max(held.sizes.get(name, 1.0), 1e-9)
        assert np.max(np.abs(curves[name] - true), initial=0.0) < 5e-3 * size, name
