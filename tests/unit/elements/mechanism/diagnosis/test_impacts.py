"""Causes of impacts from made-up gaps: late impacts and wrong restitutions are named, and nothing else."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Evidence, diagnose, hypotheses_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

impacts: Any = importlib.import_module("proofroll.elements.mechanism.diagnosis.impacts")
STEP, EVERY, G = 1e-3, 0.02, 9.81


def bounces(late: float = 0.0, e: float = 0.5) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, gap and its rate of a ball dropped from 0.3 m, whose three impacts act ``late`` [s]."""
    t = np.arange(0.0, 0.8, EVERY)
    gap, rate = 0.3 - G * t**2 / 2, -G * t
    when, fell = np.sqrt(0.6 / G), np.sqrt(0.6 * G)
    for _ in range(3):
        acts, down = when + late, -fell * late - G * late**2 / 2
        fell = e * (fell + G * late)
        on = t > acts
        since = t[on] - acts
        gap[on], rate[on] = down + fell * since - G * since**2 / 2, fell - G * since
        back = (fell + np.sqrt(fell**2 + 2 * G * down)) / G  # until the gap is closed again
        when, fell = acts + back, G * back - fell
    return t, gap, rate


def said(
    monkeypatch: pytest.MonkeyPatch, t: FloatArray, gap: FloatArray, rate: FloatArray, laws: Sequence[float] = (0.5,)
) -> list[str]:
    """Proven causes of contacts in flight, the columns of ``gap``, with these restitutions."""
    mechanism = SimpleNamespace(contacts=[SimpleNamespace(restitution=e, name=f"foot {e:g}") for e in laws])
    touch = SimpleNamespace(
        mechanism=mechanism,
        time=t,
        found=SimpleNamespace(gap=gap.reshape(len(t), -1)),
        u_n=rate.reshape(len(t), -1),
        presses=np.zeros((len(t), len(laws)), dtype=bool),
    )
    monkeypatch.setattr(impacts, "touch_of", lambda _: [touch])
    return [cause.says for cause in impacts.impacts.test(SimpleNamespace(step=STEP)) if cause.proven]


@pytest.mark.parametrize(
    ("late", "e", "words"),
    [
        (0.0, 0.5, []),
        (STEP, 0.5, ["impacts come one step (0.001 s) late"]),
        (0.0, 0.6, ["restitution of all pairs is 1.2 times"]),
    ],
)
def test_the_fault_of_an_impact_is_named(
    monkeypatch: pytest.MonkeyPatch, late: float, e: float, words: list[str]
) -> None:
    """A step that an impact comes late and another restitution are each the one cause; an exact ball has none."""
    found = said(monkeypatch, *bounces(late, e))
    assert len(found) == len(words)
    assert all(cause.startswith(word) for cause, word in zip(found, words, strict=True)), found


def test_restitutions_of_other_pairs_are_told_for_as_many_pairs_as_feet_have_corners(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of twelve pairs three have each other's restitution: these swaps are named, and equal ones are no swaps."""
    laws = [*np.linspace(0.3, 0.4, 11).tolist(), 0.4]
    found = [laws[1], laws[2], laws[0], *laws[3:]]
    t, *rows = (np.array(rows).T for rows in zip(*(bounces(e=e) for e in found), strict=True))
    (cause,) = said(monkeypatch, t[:, 0], *rows, laws)
    swaps = "foot 0.3 has that of foot 0.31; foot 0.31 has that of foot 0.32; foot 0.32 has that of foot 0.3"
    assert cause == f"restitution is of another pair: {swaps}"


@pytest.mark.parametrize("part", [0.3, 0.55, 0.8])
def test_hops_shorter_than_the_samples_resolve_accuse_nobody(monkeypatch: pytest.MonkeyPatch, part: float) -> None:
    """A sliding foot that hops at one of six samples makes no parabola: when it met the floor is not known."""
    t = 0.69 + 0.03 * np.arange(6)
    gap = np.array([2.75e-5, 3.92e-5, 3.11e-5, 5.13e-5, 1.59e-5, 7.2e-6])
    rate = np.array([6.5e-3, 1.55e-3, -1.7e-2 * part, 1.9e-2, -6.7e-4, 2.4e-3])
    assert said(monkeypatch, t, gap, rate) == []


def test_flights_that_are_no_parabolas_prove_no_delay(monkeypatch: pytest.MonkeyPatch) -> None:
    """Impacts a step late by the nearest samples are not told where the next ones miss their parabola."""
    t, gap, rate = bounces(STEP)
    hits = np.flatnonzero((rate[:-1] < 0) & (rate[1:] > 0))
    off = np.where(np.isin(np.arange(len(t)), [hits, hits + 1]), 0.0, 1e-4)
    assert said(monkeypatch, t, gap + off, rate) == []
    assert len(said(monkeypatch, t, gap + 1e-3 * off, rate)) == 1


def test_one_impact_proves_no_delay(monkeypatch: pytest.MonkeyPatch) -> None:
    """A delay that is fitted to a single impact explains no more than itself."""
    t, gap, rate = bounces(STEP)
    first = t < 0.5
    assert said(monkeypatch, t[first], gap[first], rate[first]) == []


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("law", ["friction", "restitution"])
def test_one_impact_tells_a_law_by_all_velocities_after_it(law: str) -> None:
    """Nine tenths of friction or restitution give both spheres' twelve velocities, and no other cause is told."""
    scene, times = load_scene("two_spheres"), np.arange(0.0, 0.2, 0.01)
    value = {"friction": 0.1, "restitution": 0.8}[law]
    run, true = truth(load_scene("two_spheres", **{law: 0.9 * value}), times), truth(scene, times)
    (element,) = scene.elements
    told = [cause.says for cause in diagnose(Evidence(element, [], run, true, STEP), hypotheses_of(element))]
    assert told == [f"{law} of impacts is 0.9 times"]
    assert diagnose(Evidence(element, [], true, true, STEP), hypotheses_of(element)) == []


@pytest.mark.nightly
def test_an_impact_on_a_driven_plate_is_followed() -> None:
    """A motion takes one velocity from the mechanism; its impacts have an inertia all the same."""
    bodies = (Body("plate", 1.0, inertia=(0.1,) * 3), Body("ball", 1.0, inertia=(0.004,) * 3))
    lift = Joint("lift", "prismatic", "world", "plate", axis=(0, 0, 1), motion=Formula("0.2*t"))
    joints = (lift, Joint("fall", "prismatic", "world", "ball", axis=(0, 0, 1), q0=(0.2,)))
    shapes = (Geometry("floor", "plate", "plane"), Geometry("skin", "ball", "sphere", radius=0.1))
    element, wrong = (
        MechanismElement(Mechanism(bodies, joints, geometries=shapes, pairs=(Pair("c", ("skin", "floor"), 0.0, e),)))
        for e in (0.7, 0.63)
    )
    true, run = (truth(Scene("", "", (each,)), np.arange(0, 0.3, 0.01)) for each in (element, wrong))
    (touch,) = impacts.touch_of(Evidence(element, [], run, true, STEP))
    (struck,) = impacts._struck(touch.mechanism, run, touch.found, touch.presses)
    comes, leaves = struck.before - 0.2, struck.after - 0.2
    assert -leaves[1] / comes[1] == pytest.approx(0.63, rel=2e-3)
    assert struck.root.T @ struck.root == pytest.approx(np.eye(2) / 2.0)


@pytest.mark.nightly
def test_an_impact_of_a_body_whose_origin_rests_is_followed() -> None:
    """A pendulum's frame on its hinge does not jump: the gap says when the impact was; one velocity proves no law."""
    rod = Body("rod", 1.0, (0, 0, -0.5), (0.1, 0.1, 1e-3))
    hinge = Joint("hinge", "revolute", "world", "rod", axis=(0, 1, 0), q0=(0.3,))
    tip = Geometry("tip", "rod", "sphere", (0, 0, -1.0), radius=0.05)
    wall = Geometry("wall", "world", "plane", (0.05, 0, 0), normal=(-1.0, 0, 0))
    true, run = (
        truth(Scene("pendulum", "", (MechanismElement(_mechanism(rod, hinge, tip, wall, e)),)), np.arange(0, 0.8, 0.01))
        for e in (0.7, 0.63)
    )
    element = MechanismElement(_mechanism(rod, hinge, tip, wall, 0.7))
    told = [cause.says for cause in diagnose(Evidence(element, [], run, true, STEP), hypotheses_of(element))]
    assert told == []
    (touch,) = impacts.touch_of(Evidence(element, [], run, true, STEP))
    (struck,) = impacts._struck(touch.mechanism, run, touch.found, touch.presses)
    assert -struck.after[0] / struck.before[0] == pytest.approx(0.63, rel=2e-3)


def _mechanism(body: Body, joint: Joint, tip: Geometry, wall: Geometry, e: float) -> Mechanism:
    pair = Pair("hit", (tip.name, wall.name), friction=0.3, restitution=e)
    return Mechanism(bodies=(body,), joints=(joint,), geometries=(tip, wall), pairs=(pair,))


@pytest.mark.drill
def test_a_convex_cone_at_an_impact_is_not_called_restitution() -> None:
    """MuJoCo's spheres part faster by μ times their slip, which fits all velocities without a fitted number."""
    scene = load_scene("two_spheres")
    run = simulate(scene, "mujoco", until=0.2, every=0.008, formulation="geoms", preset="matched")
    evidence = Evidence(scene.elements[0], [], run, truth(scene, run["time"].to_numpy()), STEP)
    (only,) = diagnose(evidence, hypotheses_of(scene.elements[0]))
    assert only.says.startswith("convex cone: contacts part after an impact by μ|u_t| too fast")
    assert only.fitted == 0


def test_a_model_that_leaves_an_impact_open_fits_none() -> None:
    """A rod whose friction is ten times the scene's tears at the floor; the scene's own law has a finite residual."""
    mechanism = mechanism_named("painleve_rod", friction=0.2)
    (joint,) = mechanism.joints
    struck = [impacts._Struck(0, np.array(joint.q0), np.array([-10.0, 1.0, 0.0]), np.zeros(3), np.eye(3))]
    assert np.all(np.isfinite(impacts._missed(mechanism, struck)))
    assert np.all(np.isinf(impacts._missed(impacts._scaled(mechanism, "friction", 10.0), struck)))


@pytest.mark.parametrize(("law", "factor"), [("friction", -0.3), ("restitution", -0.3), ("restitution", 2.0)])
def test_no_fit_of_impacts_ends_at_a_coefficient_that_nobody_can_give(law: str, factor: float) -> None:
    """A negative coefficient, and a restitution above 1, leave all of the velocities unexplained."""
    (element,) = load_scene("two_spheres").elements
    assert impacts._missed(impacts._scaled(element.mechanism, law, factor), []).tolist() == [np.inf]
