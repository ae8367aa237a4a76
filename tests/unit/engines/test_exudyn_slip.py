from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from slip_cases import CASES

from proofroll import load_scene
from proofroll.core.certificate import certify
from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import events_of
from proofroll.core.scene import Scene
from proofroll.core.time_grid import time_grid
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.mechanism.run.contacts.on_wall import resistance_moment
from proofroll.running.recording import record
from proofroll.running.simulation import build

pytest.importorskip("exudyn")


def cylinder(**parameters: float) -> Scene:
    """The cylinder scene at V0 = 4 m/s with μs = μk = 0.35 unless said."""
    return load_scene("sphere_in_cylinder", **{"speed": 4, "mu_static": 0.35, **parameters})


def paper() -> Scene:
    """The paper's case: rolling resistance, slip, stick, slip, fall."""
    return cylinder(rolling_resistance=5e-4)


def run(scene: Scene, until: float, every: float = 0.05, **settings: Any) -> tuple[xr.Dataset, str | None]:
    """Trajectory with events, and the reason if it ended early; a scene that slips at once has no rolling start."""
    recording = record(build(scene, "exudyn", **settings), scene, time_grid(until, every))
    return recording.dataset, recording.failure


def times_of(dataset: xr.Dataset) -> list[float]:
    """Times of the events [s], which must alternate, beginning with slip."""
    events = events_of(dataset)
    assert [event.kind for event in events] == ["slip", "stick"] * (len(events) // 2) + ["slip"] * (len(events) % 2)
    assert all(event.time_low <= event.time <= event.time_high for event in events)
    return [event.time for event in events]


PAPER = CASES["paper"][2]  # the first slip at γ = 28.02160251


def test_generic_locates_events_far_below_its_step() -> None:
    """At dt = 1e-4 s minimal coordinates give the events to 4e-7 s, with brackets of one step that hold the truth."""
    dataset, _ = run(paper(), 2.5, formulation="generic", dt=1e-4)
    # Tight, for it is the rule's own error, far above what a processor changes: 1e-12 s.
    np.testing.assert_allclose(times_of(dataset), PAPER, rtol=0, atol=4e-7)
    for event, truth in zip(events_of(dataset), PAPER, strict=True):
        assert event.time_low <= truth <= event.time_high
        assert event.time_high - event.time_low == pytest.approx(1e-4, rel=1e-6)


def test_second_order_through_the_events() -> None:
    """Halving the step divides the errors of the events by four: neither onset nor re-stick costs an order."""
    scene = paper()
    errors = [
        np.abs(np.array(times_of(run(scene, 2.5, formulation="generic", dt=dt)[0])) - PAPER) for dt in (1e-3, 5e-4)
    ]
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 2, atol=0.15)


def test_dozens_of_short_slips() -> None:
    """Just above μ = g c/V0² the ball slips and sticks sixteen times before it rolls for good; none is left out."""
    dataset, failure = run(cylinder(mu_static=0.125), 6, formulation="generic", dt=1e-3)
    assert failure is None
    assert len(times_of(dataset)) == 32


# In newtons and newton metres: what the presets' tolerances of Newton's method leave, 1e-8 in the last two. The contact
# leaves 2.5e-4 N where the ball sticks, as its friction rises by 1.4 N per µm/s. A friction of 12 N reported 6 % beside
# the applied one would be off by 0.7 N.
@pytest.mark.parametrize(
    ("settings", "exact"),
    [
        ({"formulation": "generic", "dt": 1e-3}, 1e-9),
        ({"formulation": "generic", "preset": "default"}, 1e-6),
        ({"formulation": "contact", "dt": 1e-3}, 5e-4),
    ],
)
def test_reported_friction_is_the_applied_one(settings: dict[str, Any], exact: float) -> None:
    """Through onset, slip and stick the reported force is the one that Exudyn's accelerations obey, step by step."""
    scene = paper()
    body, engine = rolling_ball(scene), build(scene, "exudyn", **settings)
    m, J, a, f = body.ball.mass, body.ball.inertia, body.ball.radius, body.contact.rolling_resistance
    engine.advance(1.7)
    for t in [*np.arange(1701, 1760) / 1000, *np.arange(2000, 2020) / 1000]:
        engine.advance(float(t))
        sample, built = engine.sample(), engine.built()
        e1 = body.surface.normal(sample.p_WB)
        moment = a * np.cross(e1, sample.force) + resistance_moment(f, -sample.force @ e1, e1, sample.v_WB)
        np.testing.assert_allclose(m * (built.acceleration - body.gravity), sample.force, atol=exact)
        np.testing.assert_allclose(J * built.angular_acceleration, moment, atol=exact)
    assert [event.kind for event in engine.events()] == ["slip", "stick"]


def test_energy_falls_only_in_slip() -> None:
    """Without resistance the energy stays while the ball sticks and falls while it slips."""
    dataset, _ = run(cylinder(mu_static=0.15), 0.75, 0.01, formulation="generic", dt=1e-3)
    change = np.diff(dataset.energy)
    sticking = dataset.sticking.to_numpy().astype(bool)
    both, neither = sticking[1:] & sticking[:-1], ~sticking[1:] & ~sticking[:-1]
    assert np.abs(change[both]).max() < 1e-2 * np.abs(change[neither]).max()
    assert change[neither].max() < 0


@pytest.mark.parametrize("preset", ["default", "matched", "tuned"])
@pytest.mark.parametrize(
    "scene",
    [
        paper(),
        cylinder(mu_static=np.inf, speed=-4, radial_spin=-20),
        load_scene("inclined_plane", mu_static=0.35),
        load_scene("inclined_plane", rolling_resistance=5e-4, cross_speed=0.2),
    ],
    ids=range(4),
)
def test_contact_certificate(preset: str, scene: Scene) -> None:
    """The contact model starts with the scene's accelerations and forces; what it softens is named and small."""
    engine = build(scene, "exudyn", formulation="contact", preset=preset)
    lines = {line.quantity: line for line in certify(engine, scene)}
    assert [line for line in lines.values() if not line.holds] == []
    assert {"mass", "ball radius", "gap", "acceleration", "N", "F2", "F3"} <= lines.keys()
    assert max(lines[name].tolerance for name in ("N", "F2", "F3", "acceleration", "angular acceleration")) < 5e-6
    # As deep as the ball sinks in: at 41 N and 1e6 N/m a six-hundredth of the radius.
    assert lines["gap in the engine"].tolerance < 1.7e-3
    assert lines["gap in the engine"].found[0] < 0
    assert "creeps" in engine.built().regularised["slip"].because


# k d = 41 N of penetration changes by the change of N: 1e-6 m; and (ω dt)² of the spin as for the other rigid bodies.
@pytest.mark.parametrize("f", [0.0, 5e-4])
def test_contact_with_unbounded_friction(f: float) -> None:
    """With unbounded friction the contact follows the rolling ball, and creeps no more than its grip says."""
    from proofroll.running.simulation import simulate

    scene = cylinder(mu_static=np.inf, rolling_resistance=f)
    found = simulate(scene, "exudyn", until=0.5, every=0.05, formulation="contact", dt=1e-3)
    truth = simulate(scene, "truth", until=0.5, every=0.05)
    assert "sticking" not in found
    assert float(np.abs(found.z - truth.z).max()) < 7e-4
    assert float(np.abs(found.N - truth.N).max()) < 0.05
    assert float(np.abs(found.gap).max()) < 2e-6


def test_rolling_needs_more_than_the_grip() -> None:
    """A grip that is too small for unbounded friction ends the run with one line instead of a slip nobody asked for."""
    engine = build(cylinder(mu_static=np.inf), "exudyn", formulation="contact", grip=0.1, dt=1e-3)
    with pytest.raises(Diverged, match="use a larger grip") as raised:
        engine.advance(0.5)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("formulation", "words"),
    [("carrier", "rolls without slip"), ("rolling_disc", "rolls without slip"), ("contact", "one coefficient")],
)
def test_what_cannot_slip_refuses(formulation: str, words: str) -> None:
    """A formulation that does not represent the law of friction says so before anything runs."""
    with pytest.raises(Refused, match=words):
        build(cylinder(rolling_resistance=5e-4, mu_kinetic=0.2), "exudyn", formulation=formulation)
