"""What engines are held against."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from proofroll.core.dataset import BY_STEPS, ENDED, ENDS, off_impacts
from proofroll.core.engine_abilities import SharesEquations
from proofroll.core.events import Event, events_of, with_events
from proofroll.core.truth import truth
from proofroll.core.verdict import Allowance, RunCurve, Verdict, judge_curve
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.reduced import Reduced
from proofroll.papers.blajer_2006.truth.plug_in import reduced
from proofroll.running.identity import resolve
from proofroll.studies.answer.judged_run import errors_of
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import Reference, _true_curves


def reference(**curves: list[float]) -> Reference:
    """A truth of which only some observables matter."""
    nothing: Any = None
    found = {name: np.array(values) for name, values in curves.items()}
    return Reference(load_scene("sphere_in_cylinder"), nothing, found, {"z": 0.2})


def test_a_percentage_of_the_first_slip_is_of_its_time() -> None:
    """The first slip at 1.7 s has that as its scale; where the ball does not slip, there is none."""
    assert reference(first_slip=[1.7]).scale("first_slip") == 1.7
    assert reference(first_slip=[]).scale("first_slip") is None
    assert reference().scale("first_slip") is None
    assert reference().scale("z") == 0.2
    assert reference().scale("event_order") is None


def test_round_off_is_that_of_the_largest_number() -> None:
    """It grows with the curve where that exceeds its scale, with the scale elsewhere, and with the time of an event."""
    assert reference(z=[3.0, -7.0]).magnitude("z") == 7.0
    assert reference(z=[0.1]).magnitude("z") == 0.2
    assert reference(first_slip=[1.7]).magnitude("first_slip") == 1.7
    assert reference().magnitude("event_order") == 0.0


def test_a_gap_has_the_round_off_of_the_places_that_it_is_between() -> None:
    """The small difference of two large places is as uncertain as these."""
    places = xr.Dataset({"p_WB": (("time", "xyz"), np.array([[3.0, -40.0, 0.2]]))})
    assert Reference(load_scene("sphere_in_cylinder"), places, {"gap": np.zeros(1)}, {}).magnitude("gap") == 40.0


def test_nothing_is_held_against_what_the_truth_does_not_tell() -> None:
    """Forces that are never determinate are no curve of the truth: engines that tell them are not judged."""
    held, told = Reference(load_scene("falling_rod"), xr.Dataset(), {}, {}), np.ones((3, 2, 3))
    allowance = Allowance("contact_forces", "N", tolerance=1.0, scale=1.0)
    judgement = judge_curve(allowance, RunCurve(told), held.true("contact_forces", told))
    assert judgement.verdict is Verdict.NOT_JUDGED
    assert judgement.reason == "not judged: the truth does not determine it here"


def test_forces_are_compared_where_and_while_they_are_determinate() -> None:
    """Those that joints share with a contact, those beside an impact and all of an ill-posed question are left out."""
    scene = load_scene("falling_rod")
    forces = np.ones((7, 1, 3))
    forces[2, 0, 1] = np.nan
    axes = ("time", "contact", "xyz")
    true = xr.Dataset(
        {"contact_forces": (axes, forces, {"units": "N", "error_bar": 1e-9})},
        {"time": 0.1 * np.arange(7)},
        {"horizon": 0.55, "ill_posed": "chance"},
    )
    curves, determinate = _true_curves(scene, with_events(true, [Event("impact", 0.35, 0.35, 0.35)]))
    mask = determinate["contact_forces"]
    assert mask[:, 0, 0].tolist() == [True, True, False, False, True, False]
    assert mask[:, 0, 1].tolist() == [True, False, False, False, True, False]
    assert curves["contact_forces"].sum() == mask.sum()


@pytest.mark.parametrize(("pressed", "judged"), [(0.0, True), (1.0, True), (np.nan, False)])
def test_zeros_beside_unknown_loads_tell_nothing(pressed: float, judged: bool) -> None:
    """Where all forces of what touches are unknown, to agree with the zero of what does not touch is no agreement."""
    forces = np.zeros((4, 2, 3))
    forces[:, 0] = pressed
    true = xr.Dataset(
        {"contact_forces": (("time", "contact", "xyz"), forces, {"units": "N", "error_bar": 1e-9})},
        {"time": 0.1 * np.arange(4)},
    )
    curves, _ = _true_curves(load_scene("falling_rod"), with_events(true, [Event("impact", 0.35, 0.35, 0.35)]))
    assert ("contact_forces" in curves) is judged


def test_forces_beside_an_early_end_are_left_out() -> None:
    """The step of an engine that holds the last known sample may hold the impact that ends the truth, too."""
    true = xr.Dataset(
        {"contact_forces": (("time", "contact", "xyz"), np.ones((4, 1, 3)), {"units": "N", "error_bar": 1e-9})},
        {"time": 0.1 * np.arange(4)},
        {ENDS: 0.305, ENDED: "a disc lies flat"},
    )
    _, determinate = _true_curves(load_scene("falling_rod"), with_events(true, []))
    assert determinate["contact_forces"][:, 0, 0].tolist() == [True, True, False]


def test_events_of_a_scene_without_any_are_too_many() -> None:
    """A run that tells a lift-off where the truth knows no event is wrong about events, and has errors elsewhere."""
    scene = load_scene("sphere_in_cylinder")
    true = truth(scene, np.linspace(0, 0.1, 11))
    told = with_events(true, [Event("lift_off", 0.05, 0.05, 0.05)])
    errors, *_ = errors_of(told, Reference.of(scene, true), whole=True)
    assert errors["event_times"] == np.inf
    assert errors["event_order"] == 1
    assert errors["z"] == 0


@pytest.mark.drill
def test_a_velocity_at_an_impact_may_be_that_of_either_side() -> None:
    """An answer counts no error where a sample lies on an impact and has the velocity before or after it."""
    scene = load_scene("two_spheres")
    (hit,) = (event.time for event in events_of(truth(scene, np.linspace(0, 0.12, 13))))
    true = truth(scene, np.linspace(0, 2 * hit, 11))
    for side in (4, 6):
        velocity = true["v_WB"].copy()
        velocity[5] = velocity[side]
        run = true.assign(v_WB=velocity)
        errors, *_ = errors_of(run, Reference.of(scene, true), whole=True)
        assert errors["v_WB"] < 1e-9


def test_forces_of_an_answer_are_not_judged_beside_an_event() -> None:
    """Nearer than the distance of the truth they count as right, also of a run that ended early, and nowhere else."""
    force = ("time", np.array([0.0, 1, 1, 1, 3, 3, 3, 3]), {"units": "N", "error_bar": 0.0})
    dataset = with_events(xr.Dataset({"forces": force}, {"time": 0.1 * np.arange(8)}), [Event("slip", 0.3, 0.3, 0.3)])
    curve = dataset["forces"].to_numpy()[1:]
    held = Reference(load_scene("falling_rod"), dataset, {"forces": curve}, {})
    run = curve + 1.0
    assert np.abs(run - held.true("forces", run).values).tolist() == [1, 1, 1, 1, 1, 1, 1]
    answered = replace(held, distance=0.1)
    assert np.abs(run - answered.true("forces", run).values).tolist() == [1, 1, 0, 1, 1, 1, 1]
    wide = replace(held, distance=0.15)
    assert np.abs(run - wide.true("forces", run).values).tolist() == [1, 0, 0, 0, 1, 1, 1]
    assert wide.true("forces", run[:3]).values.tolist() == [1, 2, 2, 3, 3, 3, 3]
    assert wide.beside_changes(np.array([0.14, 0.16, 0.44, 0.46])).tolist() == [False, True, True, False]
    passing = replace(wide, dataset=dataset.assign_attrs(borders=np.array([0.3, 0.6])))
    assert passing.changes.tolist() == [0.3, 0.6]
    assert np.abs(run - passing.true("forces", run).values).tolist() == [1, 0, 0, 0, 0, 0, 0]
    between = {"between.forces": ("between", np.array([1.0, 1, 3])), "between": np.array([0.15, 0.36, 0.55])}
    answered, held = (replace(item, dataset=dataset.assign(between)) for item in (answered, held))
    times = [run_values.off_grid(item, "forces", item.dataset) for item in (held, answered)]
    assert [item[0].tolist() for item in times if item is not None] == [[0.15, 0.36, 0.55], [0.15, 0.55]]


def test_reactions_at_the_last_sample_of_an_early_end_are_the_truths() -> None:
    """The force of a step that reaches over the end may be that of an impact behind it."""
    scene = load_scene("falling_rod")
    force = ("time", np.array([1.0, 1, 1, 1]), {"units": "N"})
    true = xr.Dataset({"normal_forces": force}, {"time": 0.1 * np.arange(4)}, {ENDS: 0.305, ENDED: "it lies flat"})
    run = true.assign(normal_forces=("time", np.array([1.0, 1, 1, 500]), {"units": "N"}))
    judged = off_impacts(scene, with_events(true, []), {0: with_events(run, [])})[0]
    assert judged["normal_forces"].to_numpy().tolist() == [1.0, 1.0, 1.0, 1.0]


@pytest.mark.drill
def test_where_most_samples_lie_on_impacts_they_are_judged() -> None:
    """Runs stay as they are where half of the samples after the first lie on impacts: else nothing would be judged."""
    scene = load_scene("two_spheres")
    (hit,) = (event.time for event in events_of(truth(scene, np.linspace(0, 0.12, 13))))
    for times, kept in ((np.array([0.0, hit * (1 + 1e-8)]), True), (np.linspace(0, 2 * hit, 11), False)):
        true = truth(scene, times)
        run = true.assign(v_WB=true["v_WB"].copy())
        assert (off_impacts(scene, true, {0: run})[0] is run) is kept


@pytest.mark.parametrize(
    ("own", "wrong"),
    [
        ([("impact", "a"), ("impact", "b")], 0),
        ([("impact", "b"), ("impact", "a")], 0),
        ([("impact", ""), ("impact", "")], 0),
        ([("impact", "a"), ("impact", "a")], 1),
        ([("impact", "a"), ("stick", "b")], 1),
        ([("impact", "a")], 1),
        ([("impact", "a"), ("impact", "c"), ("impact", "b")], 1),
    ],
)
def test_events_of_another_part_are_wrong(own: list[tuple[str, str]], wrong: int) -> None:
    """Parts of events at one time have no order, and a run need not name them; an event of another is no true one."""

    def told(events: list[tuple[str, str]]) -> xr.Dataset:
        return with_events(xr.Dataset(), [Event(kind, 0.1, 0.1, 0.1, name) for kind, name in events])

    assert run_values.event_order(told(own), told([("impact", "a"), ("impact", "b")])) == wrong


def test_an_answer_leaves_out_what_the_truth_does_not_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that tells forces beyond the truth's has errors of the rest alone."""
    places = xr.Dataset({"positions": ("time", np.zeros(2), {"error_bar": 0.0})}, {"time": [0.0, 1.0]})
    held = Reference(load_scene("falling_rod"), places, {"positions": np.zeros(2)}, {})
    given = {"positions": np.full(2, 0.5), "contact_forces": np.ones(2)}
    monkeypatch.setattr(run_values, "observables_of", lambda *_: given)
    errors, *_ = errors_of(places, held, whole=True)
    assert errors == {"positions": 0.5}


@pytest.mark.parametrize(("steps", "source"), [({BY_STEPS: "alpha"}, "reference"), ({}, "truth")])
def test_curves_say_whether_they_are_of_a_truth(steps: dict[str, str], source: str) -> None:
    """What steps lead to is a reference, whose error bar is not that of a truth."""
    times = np.linspace(0.0, 0.1, 3)
    scene, values = load_scene("sphere_in_cylinder"), np.zeros((2, 1))
    height = xr.Dataset({"z": ("time", times, {"error_bar": 0.0})}, {"time": times}, steps)
    held = Reference(scene, height, {"z": values}, {})
    assert held.true("z", values).source == source


def against(formulation: str, **parameters: float) -> str:
    """What is said of a formulation of the least model, held against the truth of a scene."""
    scene = load_scene("sphere_in_cylinder", **parameters)
    held = Reference(scene, truth(scene, np.linspace(0.0, 0.1, 3)), {}, {})
    return held.shared(resolve("reduced", {"formulation": formulation})["shares"])


@pytest.mark.drill
def test_who_rests_on_a_route_of_the_truth_is_told() -> None:
    """The least model shares the route that the truth takes in this case, or not, and the other route is named."""
    said = against("equations", rolling_resistance=5e-4)
    assert said.startswith("rests on the same equations as the truth itself (reduced equations, ")
    assert re.search(": only unreduced Newton-Euler, [^,]* checks both$", said)
    assert against("closed_form").startswith(
        "rests on the same equations as the truth itself (closed form (Blajer 2006))"
    )
    assert against("equations") == "", "here the truth is the closed form"
    assert against("closed_form", rolling_resistance=5e-4) == ""


def test_declared_routes_are_those_of_the_truth() -> None:
    """A route that shares the least model's equations is named as it names itself, so that renaming cannot hide it."""
    body = rolling_ball(load_scene("sphere_in_cylinder", rolling_resistance=5e-4))
    assert reduced(body, np.zeros(1)).route.partition(",")[0] in Reduced.shares["equations"]


def test_routes_are_declared_for_formulations_that_there_are() -> None:
    """The least model names formulations that it has; an engine that shares nothing need not say so."""
    assert isinstance(Reduced, SharesEquations)
    assert set(Reduced.shares) <= set(Reduced.presets)
    assert resolve("projection", {})["shares"] == []


@pytest.mark.one_in(2)
@pytest.mark.parametrize("until", [1e-3, 2e-2])
def test_a_percentage_of_event_times_is_one_of_the_time_of_the_run(until: float) -> None:
    """Times of events have the size of the time that a truth spans, in a scene of milliseconds as in one of hours."""
    scene = load_scene("stop", height=1e-6, restitution=0.5)
    reference = Reference.of(scene, truth(scene, np.linspace(0, until, 11)))
    assert reference.sizes["event_times"] == until
