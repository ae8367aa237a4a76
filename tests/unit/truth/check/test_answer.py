"""Answers are held to the laws: a fault behind the path is refused, and an honest answer is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray
from tests.unit.truth.test_work_of_drives import TIMES as LIFTED
from tests.unit.truth.test_work_of_drives import plate_and_ball

from proofroll.core.errors import Refused
from proofroll.core.events import events_of
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.files.scene_file import load_scene
from proofroll.truth.check.answer import _published, held_answer
from proofroll.truth.check.laws.contacts import slip_of
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.error_bars import TwoRouteMotion, cut_motion
from proofroll.truth.plug_in import MechanismTruth, _unknown_from
from proofroll.truth.truth_of_mechanism import truth_of

Array = NDArray[np.float64]
Change = Callable[[xr.Dataset], xr.Dataset]
TIMES = np.linspace(0.0, 0.8, 17)


@cache
def answer(scene: str) -> tuple[MechanismElement, TwoRouteMotion, xr.Dataset]:
    """Element, motion and dataset of the truth of a scene."""
    (element,) = load_scene(scene).elements
    assert isinstance(element, MechanismElement)
    motion = truth_of(element.mechanism, TIMES)
    return element, motion, MechanismTruth._dataset(element, motion, "")


def times(factor: float, *names: str) -> Change:
    """Values of variables that begin so, times a factor."""
    return values(lambda item: item * factor, *names)


def plus(step: float, *names: str) -> Change:
    """Values of variables that begin so, plus a step."""
    return values(lambda item: item + step, *names)


def values(change: Callable[[Array], Array], *names: str) -> Change:
    """Other values of variables that begin so."""

    def changed(dataset: xr.Dataset) -> xr.Dataset:
        chosen = [name for name in dataset.data_vars if str(name).startswith(names)]
        assert chosen, names
        return dataset.assign({name: dataset[name].copy(data=change(dataset[name].to_numpy())) for name in chosen})

    return changed


def rows(order: Callable[[list[int]], list[int]]) -> Change:
    """Samples in another order, at the times that were asked for."""

    def changed(dataset: xr.Dataset) -> xr.Dataset:
        numbers = order(list(range(dataset.sizes["time"])))
        return dataset.isel(time=numbers).assign_coords(time=dataset.time.values[: len(numbers)])

    return changed


def row(number: int, new: Callable[[Array], Array], *names: str) -> Change:
    """One sample with values of others."""

    def changed(item: Array) -> Array:
        item = item.copy()
        item[number] = new(item)
        return item

    return values(changed, *names)


def of_events(change: Callable[[xr.Dataset], xr.Dataset]) -> Change:
    """Other events."""

    def changed(dataset: xr.Dataset) -> xr.Dataset:
        events = change(dataset[[name for name in dataset.data_vars if dataset[name].dims == ("event",)]])
        return dataset.drop_dims("event").assign(events)

    return changed


MOTION = ("p_WB", "v_WB", "w_WB", "q_WB", "attitudes")
EVENTS = ("event_time", "event_low", "event_high")
FAULTS: list[tuple[str, str, Change]] = [
    ("velocities times 1.0001", "bouncing_ball", times(1.0001, "v_WB")),
    ("places a micrometre too low", "slide_to_roll", plus(-1e-6, "p_WB")),
    ("angular velocity off in its eighth digit", "heavy_top", times(1 + 1e-7, "w_WB")),
    ("conjugate quaternions", "heavy_top", values(lambda item: item * [1, -1, -1, -1], "q_WB")),
    ("attitudes of another turn", "heavy_top", values(lambda item: item[..., [0, 2, 1, 3]], "attitudes")),
    ("a sample lost", "double_pendulum", rows(lambda order: order[:-1])),
    ("a sample doubled", "double_pendulum", rows(lambda order: [*order[:6], order[5], *order[7:]])),
    ("two samples exchanged", "double_pendulum", rows(lambda order: [*order[:5], order[6], order[5], *order[7:]])),
    ("a sample interpolated", "slide_to_roll", row(6, lambda item: (item[5] + item[7]) / 2, *MOTION)),
    ("a force of another stretch", "slide_to_roll", row(12, lambda item: item[2], "force.ball", "contact_forces")),
    ("times in other units", "double_pendulum", lambda dataset: dataset.assign_coords(time=dataset.time * 1.02)),
    ("kinetic energy off by half", "pendulum", times(1.5, "energy")),
    ("energy since another start", "pendulum", plus(1e-6, "energy_error")),
    ("joint force of another sign", "pendulum", times(-1.0, "force.")),
    ("joint moment sixty times too large", "heavy_top", plus(1e-3, "torque.")),
    ("force of a slide off by 0.1 %", "servo", times(1.001, "effort.")),
    ("effort beyond its limit", "saturated_servo", times(1.0001, "effort.")),
    ("works off by 0.1 %", "servo", times(1.001, "work.")),
    ("works with five digits", "arm_pd", values(lambda item: np.round(item, 5), "work.")),
    ("dry friction off by 0.1 %", "pendulum_friction", times(1.001, "friction.")),
    ("force of a stop off by 0.1 %", "stop", times(1.001, "stop.")),
    ("contact force off by 0.1 %", "slide_to_roll", times(1.001, "force.ball_on_wall", "contact_forces")),
    ("normal forces off by 0.1 %", "slide_to_roll", times(1.001, "normal_forces")),
    ("needed friction off by 0.1 %", "slide_to_roll", times(1.001, "needed_friction")),
    ("friction on a wall off by 0.1 %", "slide_to_roll", times(1.001, "F2")),
    ("gaps off by 1e-7 m", "bouncing_ball", plus(1e-7, "gap")),
    ("slips off in their fifth digit", "slide_to_roll", times(1 + 1e-5, "slip")),
    ("coordinate off by 1e-6", "double_pendulum", plus(1e-6, "q.")),
    ("rate off in its fifth digit", "double_pendulum", times(1 + 1e-5, "v.")),
    ("tracked point off in its fourth digit", "double_pendulum", times(0.9999, "tip.", "positions")),
    ("moment against rolling off by 0.1 %", "rolling_stop", times(1.001, "torque.ball_on_wall")),
    ("moment against rolling of another sign", "rolling_stop", times(-1.0, "torque.ball_on_wall")),
    ("moment about the normal of a ball that does not resist spin", "rolling_stop", plus(1e-6, "torque.ball_on_wall")),
    ("events 1e-9 s early", "bouncing_ball", plus(-1e-9, *EVENTS)),
    ("a change of mode 1e-7 s late", "slide_to_roll", plus(1e-7, *EVENTS)),
    ("no first event", "stop", of_events(lambda events: events.isel(event=slice(1, None)))),
    (
        "no turns of a joint",
        "spring_friction",
        of_events(lambda events: events.isel(event=events.event_kind != "turn")),
    ),
    ("no turn of a contact", "falling_rod", of_events(lambda events: events.isel(event=events.event_kind != "turn"))),
    ("an impact told as a stick", "stop", values(lambda item: np.full(item.shape, "stick"), "event_kind")),
    ("an event at a fifth of its time", "stop", times(0.2, *EVENTS)),
    ("energy before an impact off by 1e-9", "bouncing_ball", times(1 + 1e-9, "event_energy_before")),
    (
        "energy after an impact that of before",
        "bouncing_ball",
        of_events(lambda events: events.assign(event_energy_after=events.event_energy_before)),
    ),
    (
        "no energies of impacts",
        "bouncing_ball",
        lambda dataset: dataset.drop_vars(["event_energy_before", "event_energy_after", "event_height"]),
    ),
    ("height after an impact off by 1e-9", "spinning_bounce", times(1 + 1e-9, "event_height")),
]


# Every second fault is planted before a change lands.
CASES = [
    pytest.param(scene, fault, id=name, marks=pytest.mark.nightly if place % 2 else ())
    for place, (name, scene, fault) in enumerate(FAULTS)
]


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(("scene", "fault"), CASES)
def test_a_fault_behind_the_path_is_refused(scene: str, fault: Change) -> None:
    """A wrong value, sample or event breaks a law, by more than ten times its allowance."""
    element, motion, dataset = answer(scene)
    assert motion.tiles is not None
    check = held_answer(element, fault(dataset), motion.tiles, TIMES)
    assert max(part for part, _, _ in check.residuals.largest.values()) > 10


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("scene", sorted({item[1] for item in FAULTS}))
def test_an_honest_answer_holds_all_laws(scene: str) -> None:
    """Samples all lie on pieces that tile the time, and no residual exceeds a tenth of its allowance."""
    element, motion, dataset = answer(scene)
    assert motion.tiles is not None
    check = held_answer(element, dataset, motion.tiles, TIMES)
    assert check.held == check.samples == len(TIMES)
    assert max(part for part, _, _ in check.residuals.largest.values()) < 0.1
    assert "at 17 of 17 samples" in check.sentence()


@pytest.mark.drill
@pytest.mark.drill
@pytest.mark.parametrize("scene", ["cylinder", "sled", "ellipsoid"])
def test_a_slip_on_a_plane_follows_from_poses_alone(scene: str) -> None:
    """Of a rim, a ball and an ellipsoid it has the speed that is published, so that its turn is asked for an event."""
    element, _, dataset = answer(scene) if scene == "sled" else thrown(scene)
    laws = LawScene(element.mechanism, element.length, element.speed / element.length)
    pieces = _published(
        element, {str(name): np.asarray(item.values) for name, item in dataset.variables.items()}
    ).pieces
    for k, contact in enumerate(laws.contacts):
        speeds = dataset["slips"].to_numpy()[:, k]
        assert speeds.max() > 1e-2 or "touch.2" in contact.name
        assert np.linalg.norm(slip_of(contact, pieces)[:, 0], axis=-1) == pytest.approx(speeds, abs=1e-12)


def thrown(kind: str) -> tuple[MechanismElement, TwoRouteMotion, xr.Dataset]:
    """A body that turns as it slides on a plane, on its shell or a rim."""
    keys: Any = (
        {"axes": (0.1, 0.08, 0.06)} if kind == "ellipsoid" else {"radius": 0.08, "length": 0.04, "axis": (0, 0.6, 0.8)}
    )
    lowest = 0.06 if kind == "ellipsoid" else 0.08 * 0.6 + 0.02 * 0.8
    q0 = (0.0, 0.0, lowest, 1.0, 0.0, 0.0, 0.0)
    joint = Joint("free", "free", "world", "body", q0=q0, v0=(0.8, 0.3, 0.0, 0.0, 0.0, 1.0))
    shapes = (Geometry("shell", "body", kind, **keys), Geometry("floor", "world", "plane"))
    body = Body("body", 1.0, inertia=(0.002, 0.003, 0.004))
    pair = Pair("touch", ("shell", "floor"), 0.2)
    mechanism = Mechanism((body,), (joint,), geometries=shapes, pairs=(pair,), gravity=(0.0, 0.0, -9.81))
    element, motion = MechanismElement(mechanism), truth_of(mechanism, TIMES[:3])
    return element, motion, MechanismTruth._dataset(element, motion, "")


@pytest.mark.drill
def test_an_impact_at_the_start_is_no_change_without_a_motion_before_it() -> None:
    """A capsule that lies on a plate that rises from time 0 on is struck there, and its answer holds all laws."""
    bodies = Body("body", 0.7, inertia=(0.002, 0.003, 0.003)), Body("plate", 1.0, inertia=(0.01,) * 3)
    joints = (
        Joint("free", "free", "world", "body", q0=(0, 0, 0.103, 1, 0, 0, 0), v0=(0.3, -0.5, 0, 0, 0, 3)),
        Joint("rises", "prismatic", "world", "plate", axis=(0.0, 0.0, 1.0), motion=Formula("0.012*sin(8*t)")),
    )
    capsule = Geometry("skin", "body", "capsule", radius=0.103, length=0.122, axis=(1.0, 0.0, 0.0))
    shapes = (capsule, Geometry("floor", "plate", "plane"))
    pairs = (Pair("touch", ("skin", "floor"), 0.3, static_friction=0.42),)
    mechanism = Mechanism(bodies, joints, geometries=shapes, pairs=pairs, gravity=(2.2, 0.0, -9.5))
    true = MechanismTruth.truth(MechanismElement(mechanism), np.linspace(0.0, 0.4, 9), ())
    assert "ended" not in true.attrs
    assert [event.kind for event in events_of(true) if event.time_low <= 0] == ["impact"] * 2
    assert float(true["v_WB"][0, 0, 2]) == pytest.approx(0.096, abs=1e-13)


def test_a_hole_in_the_motion_is_refused() -> None:
    """A part of the time that no piece covers breaks a law, though all samples hold the others."""
    element, motion, dataset = answer("double_pendulum")
    assert motion.tiles is not None
    tiles = motion.tiles
    keeps = np.flatnonzero((tiles.time[:, 0] > 0.33) | (tiles.time[:, -1] < 0.22))
    check = held_answer(element, dataset, tiles.ordered(keeps), TIMES)
    assert check.residuals.largest["tiled"][0] > 10
    assert check.held < check.samples


@pytest.mark.drill
def test_a_stop_is_held_whatever_kind_of_truth_was_chosen() -> None:
    """A joint that swings through a stop which the truth has forgotten is refused by the scene's own limits."""
    element, motion, dataset = answer("pendulum")
    (joint,) = element.mechanism.joints
    assert motion.tiles is not None
    middle = float(dataset[f"q.{joint.name}"].mean())
    mechanism = replace(element.mechanism, joints=(replace(joint, limits=(middle, 10.0)),))
    limited = replace(element, mechanism=mechanism)
    check = held_answer(limited, dataset, motion.tiles, TIMES)
    assert check.residuals.largest["stop"][0] > 10


@pytest.mark.drill
@pytest.mark.drill_of("bouncing_ball-pairs")
@pytest.mark.parametrize(("scene", "part"), [("bouncing_ball", "pairs"), ("stop", "joints")])
def test_an_impact_that_was_published_has_the_restitution_of_the_scene(scene: str, part: str) -> None:
    """A rebound whose speed is off by a millionth is refused by poses and the scene's own field alone."""
    element, motion, dataset = answer(scene)
    items = getattr(element.mechanism, part)
    changed = [replace(item, restitution=item.restitution + 1e-6) for item in items]
    other = replace(element, mechanism=replace(element.mechanism, **{part: tuple(changed)}))
    assert motion.tiles is not None
    assert held_answer(other, dataset, motion.tiles, TIMES).residuals.largest["rebound"][0] > 10


@pytest.mark.nightly
def test_works_are_held_across_an_impact() -> None:
    """A motor's work behind a blow on what it moves is that of its force and of its impulse."""
    (element,) = plate_and_ball().elements
    assert isinstance(element, MechanismElement)
    motion = truth_of(element.mechanism, LIFTED)
    dataset = MechanismTruth._dataset(element, motion, "")
    assert motion.tiles is not None
    check = held_answer(element, dataset, motion.tiles, LIFTED)
    assert check.residuals.largest["work"][0] < 0.1
    struck = dataset.time.to_numpy() > float(dataset.event_time[0])
    wrong = dataset.assign({"work.drive.shake": dataset["work.drive.shake"] * (1 + 1e-6 * struck)})
    assert held_answer(element, wrong, motion.tiles, LIFTED).residuals.largest["work"][0] > 10


@pytest.mark.drill
def test_a_broken_law_ends_a_truth_and_keeps_what_lies_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """The truth has the samples before the fault, and says what breaks which law; from the start it is refused."""
    plain = MechanismTruth.__dict__["_dataset"].__func__

    def at(number: int) -> Callable[..., xr.Dataset]:
        def faulty(element: MechanismElement, motion: TwoRouteMotion, branches: str) -> xr.Dataset:
            dataset = plain(element, motion, branches)
            count = dataset.sizes["time"]
            return row(number, lambda item: item[number] + 1e-3, "v_WB")(dataset) if number < count else dataset

        return faulty

    monkeypatch.setattr(MechanismTruth, "_dataset", staticmethod(at(10)))
    found = truth(load_scene("double_pendulum"), TIMES)
    assert found.sizes["time"] == 10
    assert found.attrs["ended"].startswith("what the truth publishes breaks the law")
    assert "laws" not in found.attrs
    monkeypatch.setattr(MechanismTruth, "_dataset", staticmethod(at(0)))
    with pytest.raises(Refused, match="what the truth publishes breaks the law"):
        truth(load_scene("double_pendulum"), TIMES)


@pytest.mark.parametrize("scene", ["double_pendulum", pytest.param("oscillators", marks=pytest.mark.drill)])
def test_energy_changes_from_the_start_of_a_scene(scene: str) -> None:
    """Of samples that begin later it counts from time 0, too, and the check refuses what counts from the first."""
    element, _, whole = answer(scene)
    motion = truth_of(element.mechanism, TIMES[8:])
    later = MechanismTruth._dataset(element, motion, "")
    name = next(str(name) for name in later.data_vars if str(name) in {"energy_change", "energy_error"})
    assert later[name].to_numpy() == pytest.approx(whole[name].to_numpy()[8:], abs=1e-12)
    assert motion.tiles is not None
    for offset, law in ((0.0, None), (1e-9, "value")):
        wrong = later.assign({name: later[name].copy(data=later[name].to_numpy() + offset)})
        first = held_answer(element, wrong, motion.tiles, TIMES[8:]).residuals.first
        assert (None if first is None else first.law) == law


def test_a_bar_is_the_largest_over_the_times() -> None:
    """Forces, whose bars rise and fall, have the largest of all samples, not that of the last."""
    element, motion, _ = answer("slide_to_roll")
    bar = motion.bars["pressed"].copy()
    bar[5] = 2 * bar.max()
    dataset = MechanismTruth._dataset(element, replace(motion, bars=motion.bars | {"pressed": bar}), "")
    assert dataset["contact_forces"].attrs["error_bar"] == bar[5]


@pytest.mark.parametrize("wide", [1e-6, 0.2])
def test_a_truth_ends_before_an_event_that_its_routes_tell_far_apart(wide: float) -> None:
    """A bracket of a fifth of the natural time says that routes part; one of 1e-6 is a bar."""
    element, motion, _ = answer("stop")
    (event, *others), width = motion.events, wide * element.length / element.speed
    event = replace(event, time_low=event.time - width / 2, time_high=event.time + width / 2)
    found = _unknown_from(element, replace(motion, events=(event, *others)))
    text = f"the two routes part, and tell {event.kind} of {event.name} {width:.2g} s apart; please report it"
    assert found == ((event.time_low, text) if wide == 0.2 else None)


def test_a_motion_is_cut_with_its_events_and_bars() -> None:
    """A motion that is cut ends before the time."""
    _, motion, _ = answer("bouncing_ball")
    left = cut_motion(motion, 0.3, "so")
    assert left.record.time[-1] < 0.3
    assert not left.events
    assert {len(bar) for bar in left.bars.values()} == {len(left.record.time)}
    assert (left.end, left.ended) == (0.3, "so")


# Shares of samples, bounds of what is known, and heights behind the last impact: what no law of the motion tells.
UNTOLD = {"unpressed", "event_high", "event_low", "event_height"}


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(
    "scene", ["slide_to_roll", "stop", "double_pendulum", "engine_on_mounts", "servo", "gear_pair"]
)
def test_each_variable_that_is_published_is_held(scene: str) -> None:
    """Each number that a truth publishes, but a named few, breaks a law if it is shifted by a thousandth."""
    element, motion, dataset = answer(scene)
    assert motion.tiles is not None
    silent = set[str]()
    for name, item in dataset.data_vars.items():
        if item.dtype.kind == "f" and np.isfinite(item).any():
            step = 1e-3 * max(float(np.nanmax(np.abs(item))), 1e-2)
            check = held_answer(element, dataset.assign({name: item + step}), motion.tiles, TIMES)
            silent |= {str(name)} if max(part for part, _, _ in check.residuals.largest.values()) <= 1 else set()
    assert silent <= UNTOLD


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "name",
    ["gap", "down", "across_rate", "omega1", "omega3", "cone_excess", "natural_map", "drift", "forces", "positions"],
)
def test_names_and_residuals_of_a_ball_are_held(name: str) -> None:
    """What is published of a ball in the frame of its wall, tables and residuals of laws are held to the motion."""
    element, motion, dataset = answer("slide_to_roll")
    assert motion.tiles is not None
    changed = dataset.assign({name: dataset[name] + 1e-6})
    check = held_answer(element, changed, motion.tiles, TIMES)
    assert max(part for part, _, _ in check.residuals.largest.values()) > 10
