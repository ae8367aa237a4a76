"""Audits of contacts: what a right run leaves, and what a wrong force or velocity shows."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr
from closed_balls import A, G, sliding_to_roll

from proofroll.core.truth import truth
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.contacts.audits import contact_audits
from proofroll.elements.mechanism.run.dataset import columns
from proofroll.elements.mechanism.run.element import MechanismElement, the_mechanism
from proofroll.files.scene_file import load_scene

TIMES, MU, MASS = np.linspace(0, 0.25, 81), 0.2, 0.517


@cache
def sliding() -> tuple[MechanismElement, xr.Dataset]:
    """A ball that slides on a plane, in closed form, as a run of a mechanism with a contact."""
    element = the_mechanism(load_scene("slide_to_roll"))
    p, v, w, _ = sliding_to_roll({}, TIMES)
    way = v[0] / np.linalg.norm(v[0])
    force = np.repeat((MASS * G * (np.array([0, 0, 1.0]) - MU * way))[None], len(TIMES), axis=0)
    q = np.repeat([[1.0, 0.0, 0.0, 0.0]], len(TIMES), axis=0)  # the ball's centre of mass is in its middle
    placed = Placed(element.mechanism, TIMES, *(values[:, None] for values in (p, v, w, q)))
    wrench = np.zeros((len(TIMES), 2, len(element.mechanism.connections), 3))
    return element, columns(element, placed, wrench, force[:, None], np.zeros((len(TIMES), 0))).dataset()


def audits(run: xr.Dataset) -> dict[str, np.ndarray]:
    """Audits of a run of the sliding ball."""
    return contact_audits(sliding()[0].mechanism, run)


def test_audits_of_a_right_run_vanish() -> None:
    """The forces are those that the motion needs, and the velocities the rates of the places, to the splines' error."""
    assert sliding()[1]["p_WB"].max() > A
    found = audits(sliding()[1])
    assert found["force_audit"].max() < 1e-9 * MASS * G
    assert found["rate_audit"].max() < 1e-10


def test_a_force_that_does_not_belong_to_the_motion_shows_by_its_size() -> None:
    """A tenth of a newton more is a tenth of a newton in the audit."""
    run = sliding()[1]
    more = np.zeros(run["contact_forces"].shape)
    more[..., 2] = 0.1
    wrong = run.assign(contact_forces=run["contact_forces"] + more)
    assert audits(wrong)["force_audit"] == pytest.approx(0.1, rel=1e-6)
    unknown = run.assign(contact_forces=run["contact_forces"] * np.nan)
    assert set(audits(unknown)) == {"rate_audit"}


def test_a_velocity_of_its_own_shows_by_its_size() -> None:
    """A velocity that is not the rate of the place shows, also where it is constant."""
    run = sliding()[1]
    more = np.zeros(run["v_WB"].shape)
    more[..., 1] = 0.01
    assert audits(run.assign(v_WB=run["v_WB"] + more))["rate_audit"] == pytest.approx(0.01, rel=1e-6)
    assert audits(run.assign(v_WB=run["v_WB"] * np.inf)) == {}


@pytest.mark.drill
@pytest.mark.parametrize("name", ["sled", "free_turntable"])
def test_audits_of_the_truth_vanish(name: str) -> None:
    """On three feet, and on a table whose hinge bears a load, too, so that the table is left out."""
    scene = load_scene(name)
    run = truth(scene, TIMES)
    found = contact_audits(the_mechanism(scene).mechanism, run)
    assert found["force_audit"].max() < 1e-6 * float(run["normal_forces"].max())
    assert found["rate_audit"].max() < 1e-8


def test_energy_of_a_resisted_slip_balances() -> None:
    """Rolling resistance of a ball that slips acts against its turning, not against the velocity of its centre."""
    scene = load_scene("slide_to_roll", side_spin=40, normal_spin=9, rolling_resistance=5e-3)
    curves = the_mechanism(scene).observe(truth(scene, np.linspace(0, 0.1, 31)))
    assert np.abs(curves["energy_balance"]).max() < 1e-4  # along the centre's velocity: 0.1 J
