"""A ball of a mechanism in the local frame of its wall, held against the ball's own variables and observables."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr
from balls_as_bodies import as_bodies

from proofroll.core.dataset import observe, scales
from proofroll.core.events import Event, EventKind, with_events
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.contacts.stretches import held_in_flight, with_sticking
from proofroll.elements.mechanism.run.dataset import columns
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.files.scene_file import load_scene

# Scenes that a ball's own mechanics follows, with motions about all axes
SCENES = {
    "sphere_in_cylinder": {"axial_speed": 0.7, "radial_spin": 12.0, "rolling_resistance": 5e-4},
}


@cache
def pair(name: str) -> tuple[Scene, xr.Dataset, Scene, xr.Dataset]:
    """A ball's scene with its truth, and the same motion as a run of the scene read as bodies."""
    own = load_scene(name, asks=("orientation",), **SCENES[name])
    times = np.linspace(0, 0.5, 101)
    run = truth(own, times)
    scene = as_bodies(name, **SCENES[name])
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    count = len(element.bodies)
    still = np.zeros((len(times), 3))
    p, v, w = (np.stack([run[f].to_numpy(), *[still] * (count - 1)], axis=1) for f in ("p_WB", "v_WB", "w_WB"))
    q = np.stack([run["q_WB"].to_numpy()] * count, axis=1)
    surface = own.elements[0].rolling.surface  # type: ignore[attr-defined]
    local = np.stack([-run["N"].to_numpy(), run["F2"].to_numpy(), run["F3"].to_numpy()], axis=-1)
    force = np.einsum("tij,tj->ti", surface.frame(surface.locate(run["p_WB"].to_numpy())), local)
    connections = len(element.mechanism.connections)
    made = columns(
        element,
        Placed(element.mechanism, times, p, v, w, q),
        np.zeros((len(times), 2, connections, 3)),
        force[:, None],
        np.zeros((len(times), 0)) if count == 1 else np.zeros((len(times), 1)),
    ).dataset()
    if "event_kind" in run:
        made = made.assign({key: run[key] for key in run.variables if str(key).startswith("event")})
    return own, run, scene, made


@pytest.mark.parametrize("name", SCENES)
def test_variables_are_those_of_the_ball(name: str) -> None:
    """Coordinates, rates, spin, slip, forces, needed friction and gap, by charts and laws of the mechanism alone."""
    own, run, _, made = pair(name)
    names = [*own.elements[0].rolling.surface.coordinates, "N", "F2", "F3", "needed_friction", "gap", "attitude"]  # type: ignore[attr-defined]
    names += [f"omega{k}" for k in (1, 2, 3)] + ["slip2", "slip3", "slip"] + [f"{key}_rate" for key in names[:2]]
    for key in names:
        size = max(1.0, float(np.abs(run[key]).max()))
        sign = np.sign(float((made[key] * run[key]).sum())) if key == "attitude" else 1.0
        # Ten times what is seen
        assert np.abs(sign * made[key].to_numpy() - run[key].to_numpy()).max() <= 1e-12 * size, key


@pytest.mark.parametrize("name", SCENES)
def test_observables_are_those_of_the_ball(name: str) -> None:
    """Balance of energy, audits, creep, first slip and all others, with their sizes, as of the ball's own element."""
    own, run, scene, made = pair(name)
    expected, found = observe(own, run), observe(scene, made)
    assert set(found) == set(expected)
    for key, values in expected.items():
        assert found[key].shape == values.shape, key
        size = max(1.0, float(np.abs(values).max(initial=0.0)))
        if key != "attitude":
            assert np.abs(found[key] - values).max(initial=0.0) <= 1e-7 * size, key
    sizes = scales(scene, made)
    assert sizes == pytest.approx({key: value for key, value in scales(own, run).items() if key in sizes}, rel=1e-9)
    assert [item.name for item in scene.elements[0].observables] == [item.name for item in own.elements[0].observables]


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


@pytest.mark.parametrize("name", ["sphere_in_cylinder"])
def test_the_truth_of_a_ball_as_a_body_is_told_in_its_local_frame(name: str) -> None:
    """Each variable of the local frame agrees with the ball's own truth within both bars."""
    own = load_scene(name, **SCENES[name])
    times = np.linspace(0, 0.2, 5)
    run, general = truth(own, times), truth(as_bodies(name, **SCENES[name]), times)
    for key in (*own.elements[0].rolling.surface.coordinates, "N", "F2", "F3", "omega1", "omega3", "needed_friction"):  # type: ignore[attr-defined]
        bar = float(general[key].attrs["error_bar"]) + float(run[key].attrs["error_bar"])
        assert np.abs(general[key].to_numpy() - run[key].to_numpy()).max() <= bar, key
        # Of the size of a value's round-off, not of the value
        assert float(general[key].attrs["error_bar"]) < 1e-8 * max(1.0, float(np.abs(run[key]).max())), key
