"""A ball of a mechanism in the local frame of its wall, held against the ball's own variables and observables."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from proofroll.core.events import Event, EventKind, with_events
from proofroll.core.truth import truth
from proofroll.elements.mechanism.run.contacts.stretches import held_in_flight, with_sticking
from proofroll.files.scene_file import load_scene
from proofroll.truth.plug_in import MechanismTruth


def test_events_say_when_a_ball_sticks() -> None:
    """Before its first stick a ball slips, and between a slip and a stick; without a bound nobody is asked."""
    plain = xr.Dataset(coords={"time": np.linspace(0, 1, 11)})
    told = with_events(plain, [Event(kind, t, t, t) for kind, t in ((EventKind.STICK, 0.3), (EventKind.SLIP, 0.65))])
    bounded, unbounded = (load_scene(name).elements[0].on_wall for name in ("slide_to_roll", "bowl"))  # type: ignore[attr-defined]
    sticks = with_sticking(bounded, told)["sticking"].to_numpy()
    assert sticks.tolist() == [False] * 3 + [True] * 4 + [False] * 4
    assert "sticking" not in with_sticking(unbounded, told)


def test_in_flight_a_ball_has_neither_gap_nor_slip() -> None:
    """From a lift-off to the next impact both are zero, for they would count as errors of a ball that should roll."""
    size = {name: ("time", np.ones(11)) for name in ("gap", "slip", "slip2", "slip3")}
    off_grid = {"between.gap": ("between", np.ones(3))}
    plain = xr.Dataset(size | off_grid, coords={"time": np.linspace(0, 1, 11), "between": [0.15, 0.45, 0.75]})
    assert held_in_flight(plain) is plain
    kinds = (EventKind.LIFT_OFF, 0.25), (EventKind.IMPACT, 0.65), (EventKind.LIFT_OFF, 0.95)
    told = held_in_flight(with_events(plain, [Event(kind, t, t, t) for kind, t in kinds]))
    for name in size:
        assert told[name].to_numpy().tolist() == [1.0] * 3 + [0.0] * 4 + [1.0] * 3 + [0.0]
    assert told["between.gap"].to_numpy().tolist() == [1.0, 0.0, 1.0]


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("name", "start"),
    [
        ("bowl", {}),
        pytest.param("cone", {}, marks=pytest.mark.drill),
        pytest.param("torus_rim", {"outward_speed": 0.1, "normal_spin": 3.0}, marks=pytest.mark.drill),
        pytest.param("turntable", {"tilt": 0.2, "normal_spin": 12.0}, marks=pytest.mark.drill),
    ],
)
def test_the_local_frame_leads_back_to_the_world(name: str, start: dict[str, float]) -> None:
    """Coordinates are those of the centre; spin, slip and forces are those of the world along the frame there."""
    scene = load_scene(name, **start)
    run = truth(scene, np.linspace(0, 0.1, 3)).isel(body=0)
    body = scene.elements[0].on_wall  # type: ignore[attr-defined]
    u = np.stack([run[key].to_numpy() for key in body.surface.coordinates], axis=-1)
    frame = body.surface.frame(u)
    assert body.surface.position(u) == pytest.approx(run["p_WB"].to_numpy(), abs=1e-12)
    spin = np.stack([run[f"omega{k}"].to_numpy() for k in (1, 2, 3)], axis=-1)
    assert np.einsum("tij,tj->ti", frame, spin) == pytest.approx(run["w_WB"].to_numpy(), abs=1e-10)
    local = np.stack([-run["N"].to_numpy(), run["F2"].to_numpy(), run["F3"].to_numpy()], axis=-1)
    pair = scene.elements[0].mechanism.pairs[0].name  # type: ignore[attr-defined]
    force = np.stack([run[f"force.{pair}.{axis}"].to_numpy() for axis in "xyz"], axis=-1)
    assert np.einsum("tij,tj->ti", frame, local) == pytest.approx(force, abs=1e-10)
    assert run["slip"].to_numpy() == pytest.approx(0.0, abs=1e-10)


@pytest.mark.drill
def test_the_general_truth_of_a_ball_that_rolls_evenly_agrees_with_its_own() -> None:
    """Each variable of the local frame lies within the bars of both truths."""
    scene = load_scene("sphere_in_cylinder", axial_speed=0.7, radial_spin=12.0, rolling_resistance=5e-4)
    (element,), times = scene.elements, np.linspace(0, 0.2, 5)
    run, general = truth(scene, times), MechanismTruth.truth(element, times, ())
    for key in ("gamma", "z", "N", "F2", "F3", "omega1", "omega3", "needed_friction"):
        bar = float(general[key].attrs["error_bar"]) + float(run[key].attrs["error_bar"])
        assert np.abs(general[key].to_numpy() - run[key].to_numpy()).max() <= bar, key
        # Of the size of a value's round-off, not of the value
        assert float(general[key].attrs["error_bar"]) < 1e-8 * max(1.0, float(np.abs(run[key]).max())), key
