"""A run is held against the truth as far as both go."""

from __future__ import annotations

import math

import numpy as np
import pytest

from proofroll import load_scene
from proofroll.core.dataset import observe, scales
from proofroll.core.events import Event, with_events
from proofroll.core.scene import Scene
from proofroll.core.time_grid import time_grid
from proofroll.core.truth import truth
from proofroll.running.recording import record
from proofroll.running.simulation import build
from proofroll.studies.judging.reference import Reference
from proofroll.studies.judging.run_values import observables_of

TIMES = time_grid(0.4, 5e-3)


def reference(scene: Scene) -> Reference:
    """The truth of the scene."""
    dataset = truth(scene, TIMES)
    return Reference(scene, dataset, observe(scene, dataset), scales(scene, dataset))


@pytest.mark.nightly
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


@pytest.mark.drill
def test_without_lift_off_nothing_changes() -> None:
    """Where the truth's ball stays on the wall, nothing is cut."""
    scene = load_scene("sphere_in_cylinder")
    whole = reference(scene)
    run = record(build(scene, "reduced"), scene, TIMES).dataset
    held, cut = whole.common_span({1.0: run})
    assert held.dataset.equals(whole.dataset)
    assert cut[1.0].equals(run)
