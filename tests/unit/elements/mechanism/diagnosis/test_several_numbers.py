"""Several terms that an engine moves a mechanism without, or besides, are named together or not at all."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import proofroll
from proofroll.core.diagnosis import Evidence, diagnose, hypotheses_of
from proofroll.core.scene import Scene

STEP = 1e-3  # s


def moved(scene: Scene, truth: xr.Dataset, gyroscopic: float, decay: float) -> xr.Dataset:
    """Run of a body on a ball joint whose gyroscopic moment has a factor, and whose momenta decay [1/s]."""
    (body,) = scene.elements[0].mechanism.bodies
    com, mass, gravity = np.array(body.com), body.mass, np.array(scene.elements[0].mechanism.gravity)

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        q, w = state[:4], state[4:]
        R = Rotation.from_quat(q, scalar_first=True)
        A = R.as_matrix()
        inertia, arm = A @ np.array(body.inertia) @ A.T, A @ com
        about_pivot = inertia + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        load = mass * np.cross(arm, gravity - np.cross(w, np.cross(w, arm)))
        load = load - gyroscopic * np.cross(w, inertia @ w) - decay * about_pivot @ w
        turning = np.array([-q[1:] @ w, *(q[0] * w + np.cross(w, q[1:]))]) / 2
        return np.concatenate([turning, np.linalg.solve(about_pivot, load)])

    first = np.concatenate([np.ravel(truth[name].to_numpy()[0]) for name in ("q_WB", "w_WB")])
    times = truth["time"].to_numpy()
    states = solve_ivp(rates, times[[0, -1]], first, t_eval=times, rtol=1e-11, atol=1e-11).y.T
    run = truth.copy(deep=True)
    for name, part in (("q_WB", states[:, :4]), ("w_WB", states[:, 4:])):
        run[name] = truth[name].dims, part.reshape(truth[name].shape)
    return run


def causes(gyroscopic: float, decay: float) -> list[str]:
    """Ids and clauses of the causes of a run of a slow top."""
    scene = proofroll.load_scene("heavy_top", spin=20.0)
    truth = proofroll.simulate(scene, until=0.3, every=0.005)
    evidence = Evidence(scene.elements[0], [], moved(scene, truth, gyroscopic, decay), truth, STEP)
    return [f"{cause.id}: {cause.says}" for cause in diagnose(evidence, hypotheses_of(scene.elements[0]))]


@pytest.mark.drill
def test_two_missing_terms_are_named_together() -> None:
    """An engine with damping and without the gyroscopic moment is told so, and of no single term that leaves a rest."""
    (cause,) = causes(0.0, 0.05)
    assert cause.startswith("several numbers: ")
    assert "the gyroscopic moments w x I w left out" in cause
    assert "damped at a rate of 0.05 per second" in cause


@pytest.mark.drill
def test_one_term_is_named_alone() -> None:
    """A single cause keeps its name."""
    assert causes(0.0, 0.0)[0].startswith("gyroscopic terms: ")
