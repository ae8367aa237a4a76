"""Rolling in maximal coordinates: a witness that shares neither coordinates nor equations with a ball's two routes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import xarray as xr
from lone_routes import by_bodies, by_series
from placed_balls import run_of
from rolling_rows import rolling_equations
from rolling_scenes import rolling_scene

from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.files.scene_file import load_scene
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates

TIMES = np.linspace(0, 2, 9)
# Of the witness, relative to sizes of 1 m, 1 N, 1 rad/s and more: where both routes say exactly zero, it says 1e-17.
ROUND_OFF = 1e-14


def outside(true: xr.Dataset, witness: xr.Dataset, names: dict[str, str]) -> dict[str, float]:
    """How far off variables are that are off by more than their error bars and the witness's own round-off."""
    found = {}
    for name, own in names.items():
        values = true[name].to_numpy().astype(float)
        off = float(np.nanmax(np.abs(witness[own].to_numpy().astype(float) - values)))
        whole = {"N": "N", "J": "energy"}.get(true[name].attrs["units"], "")  # of which residuals are differences
        size = witness["w_WB"].to_numpy() if own.startswith("omega") else witness[whole] if whole else values
        if off > true[name].attrs["error_bar"] + ROUND_OFF * max(1.0, np.nanmax(np.abs(size))):
            found[name] = off
    return found


def witnessed(scene: Scene, element: MechanismElement) -> xr.Dataset:
    """The ball of a scene by rows of rolling, with all other elements in the same equations."""
    mechanism, rolling = rolling_scene(scene)
    record = by_series(MaximalCoordinates(mechanism, rolling_equations(rolling)), TIMES)
    ball = mechanism.body_index[element.name]
    contact = len(mechanism.joints) + len(mechanism.loops) + [one.body for one in rolling].index(element.name)
    motion = record.p_WB[:, ball], record.v_WB[:, ball], record.w_WB[:, ball]
    return run_of(Scene(element.name, "", (element,)), TIMES, *motion, force=record.wrench[:, contact, :3])


@pytest.mark.drill
def test_truth_of_a_ball_agrees_with_rolling_rows() -> None:
    """Motion and forces of a rolling ball lie within the error bars that two other routes gave them."""
    pytest.importorskip("heyoka")
    scene = load_scene("sphere_in_cylinder")
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    found, true = witnessed(scene, element), truth(scene, TIMES)
    assert {"N", "F2", "F3", "omega1"} <= set(true.data_vars)
    assert not outside(true, found, {str(name): str(name) for name in true.data_vars if name in found})


@pytest.mark.nightly
def test_numbers_and_series_agree() -> None:
    """DOP853 on the same rows, projected after each step, moves the ball as the series do."""
    pytest.importorskip("heyoka")
    mechanism, rolling = rolling_scene(load_scene("sphere_in_cylinder"))
    route = MaximalCoordinates(mechanism, rolling_equations(rolling))
    one, two = by_bodies(route, TIMES[:3], 1e-12), by_series(route, TIMES[:3])
    assert np.abs(one.p_WB - two.p_WB).max() < 1e-12
    assert one.residual.max() < 1e-12


@pytest.mark.drill
def test_truth_of_a_mixed_scene_agrees_with_rolling_rows() -> None:
    """A ball in a cylinder beside a pendulum, in one system of equations, is within the bars of the truth of each."""
    pytest.importorskip("heyoka")
    scene, other = load_scene("sphere_in_cylinder"), load_scene("pendulum")
    (ball,), (pendulum,) = scene.elements, other.elements
    assert isinstance(ball, MechanismElement)
    fallen = dataclasses.replace(pendulum.mechanism, gravity=(0.0, 0.0, -9.81))  # type: ignore[attr-defined]
    mixed = dataclasses.replace(scene, elements=(ball, dataclasses.replace(pendulum, mechanism=fallen)))
    true = truth(mixed, TIMES)
    names = {str(name): str(name).removesuffix(f".{ball.name}") for name in true.data_vars}
    witness = witnessed(mixed, ball)
    balls = {name: own for name, own in names.items() if name != own and own in witness}
    assert len(balls) > 10
    assert not outside(true, witness, balls)
    mechanism, rolling = rolling_scene(mixed)
    record = by_series(MaximalCoordinates(mechanism, rolling_equations(rolling)), TIMES)
    angle = next(name for name in true.data_vars if str(name).startswith("v.pivot"))
    assert np.abs(record.v[:, -1] - true[angle].to_numpy()).max() < true[angle].attrs["error_bar"] + 1e-12


def test_resistance_that_rows_do_not_have_is_refused() -> None:
    """Rolling resistance is named; nothing is left out in silence."""
    with pytest.raises(Refused, match="rolling resistance of ball"):
        rolling_scene(load_scene("sphere_in_cylinder", rolling_resistance=5e-4))
