"""The truth of bodies that touch is that of the same bodies in a turned world: events, reasons and error bars."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from turned_scenes import turned_mechanism

from proofroll.core.errors import InputError, Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.start import natural_scale
from proofroll.elements.mechanism.run.element import MechanismElement, the_mechanism
from proofroll.elements.mechanism.scene.rotations import from_rpy
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll.studies.judging.judge import judge
from proofroll.truth.check.answer import held_answer
from proofroll.truth.plug_in import MechanismTruth
from proofroll.truth.truth_of_mechanism import truth_of
from proofroll_drill.referee.random_contacts import random_contacts

NIGHTLY = pytest.mark.nightly
ROLLING, SPINNING = 2e-3, 3e-3  # m
APART = 3.0  # factor between bars, whose round-off depends on the axes
LEAST = 1e-12  # bars, relative to values above 1 in SI units, below which they are round-off alone
SCENES = {
    "sled": 0.65, "eccentric_sphere": 0.6, "rolling_coin": 0.2, "rattleback": 0.1, "free_turntable": 0.3,
    "spinning_bounce": 0.5, "two_spheres": 0.3, "ladder": 0.3, "falling_rod": 0.6,
    "sled_on_slope": 0.3, "tilted_disc": 0.2, "rocking_block": 0.3,
}  # fmt: skip


def with_resistance(mechanism: Mechanism) -> Mechanism:
    """The mechanism with resistance against rolling and spinning in each pair that may have it."""
    pairs = list(mechanism.pairs)
    for k, pair in enumerate(mechanism.pairs):
        try:
            resisted = dataclasses.replace(pair, rolling_resistance=ROLLING, spinning_friction=SPINNING)
            dataclasses.replace(mechanism, pairs=(*pairs[:k], resisted, *pairs[k + 1 :]))
        except InputError:
            continue
        pairs[k] = resisted
    return dataclasses.replace(mechanism, pairs=tuple(pairs))


def ball(slides: float, spins: float) -> Mechanism:
    """A ball that slides and spins on a plane, against friction of each kind."""
    v0 = (0.9 + slides, -0.5, 0.0, 5.0, 9.0, spins)
    free = Joint("free", "free", "world", "ball", q0=(0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0), v0=v0)
    shapes = (Geometry("s", "ball", "sphere", radius=0.1), Geometry("floor", "world", "plane"))
    pair = Pair("touch", ("s", "floor"), 0.3, rolling_resistance=ROLLING, spinning_friction=SPINNING)
    return Mechanism((Body("ball", 1.0, inertia=(0.004,) * 3),), (free,), geometries=shapes, pairs=(pair,))


def resting_sled(lean: float, rpy: tuple[float, float, float]) -> MechanismElement:
    """A sled that sticks on three feet to a plane, with gravity off its normal by ``lean`` [rad], in a turned world."""
    free = Joint("free", "free", "world", "sled", q0=(0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0))
    feet = [
        Geometry(f"foot{k}", "sled", "sphere", (x, y, -0.08), radius=0.02)
        for k, (x, y) in enumerate(((0.15, 0.10), (0.15, -0.10), (-0.20, 0.03)))
    ]
    mechanism = Mechanism(
        (Body("sled", 2.0, inertia=(0.02, 0.03, 0.04)),),
        (free,),
        gravity=(9.81 * np.sin(lean), 0.0, -9.81 * np.cos(lean)),
        geometries=(Geometry("floor", "world", "plane"), *feet),
        pairs=tuple(Pair(f"touch{k}", (f"foot{k}", "floor"), friction=0.6) for k in range(3)),
    )
    return MechanismElement(turned_mechanism(mechanism, rpy, (0.0, 0.0, 0.0)))


def assert_the_same_elsewhere(mechanism: Mechanism, until: float, seed: int) -> None:
    """The truth of a mechanism is its truth in a world turned at random."""
    rpy = tuple(np.random.default_rng(seed).uniform(-3, 3, 3))
    times, R = np.linspace(0.0, until, 4), from_rpy(rpy)
    try:
        here = truth_of(mechanism, times)
    except Refused as error:
        with pytest.raises(Refused, match=str(error)[:20]):
            truth_of(turned_mechanism(mechanism, rpy, (0.0, 0.0, 0.0)), times)
        return
    there = truth_of(turned_mechanism(mechanism, rpy, (0.0, 0.0, 0.0)), times)
    assert (here.horizon, here.end) == pytest.approx((there.horizon, there.end), rel=1e-6)
    assert here.ended.split(" at t =")[0] == there.ended.split(" at t =")[0]
    assert [(event.kind, event.name) for event in here.events] == [(event.kind, event.name) for event in there.events]
    for one, other in zip(here.events, there.events, strict=True):
        wide = (one.time_high - one.time_low + other.time_high - other.time_low) / 2
        assert one.time == pytest.approx(other.time, abs=wide)
    for name in ("p_WB", "v_WB", "w_WB"):
        bars = here.bars[name][-1] + there.bars[name][-1]
        turned = getattr(here.record, name) @ R.T
        assert np.nanmax(np.abs(turned - getattr(there.record, name))) <= bars
    for name, bar in here.bars.items():
        least = LEAST * float(np.nanmax(np.abs(getattr(here.record, name, 1.0)), initial=1.0))
        known = sorted([max(float(bar[-1]), least), max(float(there.bars[name][-1]), least)])
        assert known[1] <= APART * known[0], name


def _cases() -> list[Any]:
    drilled = {"eccentric_sphere", "rolling_coin"}
    return [
        pytest.param(name, resisted, marks=pytest.mark.drill if name in drilled and resisted else NIGHTLY)
        for name in SCENES
        for resisted in (False, True)
    ]


@pytest.mark.drill
@pytest.mark.nightly_of("0.0-0.0-1", "0.0-7.0-2")
@pytest.mark.arithmetic
@pytest.mark.parametrize(("slides", "spins", "seed"), [(0.0, 0.0, 1), (0.0, 7.0, 2), (1.5, -4.0, 3)])
def test_a_ball_with_resistance_rolls_alike_in_a_turned_world(slides: float, spins: float, seed: int) -> None:
    """A ball that rolls, spins or slides against resistance has the same truth whatever the axes are."""
    assert_the_same_elsewhere(ball(slides, spins), 0.3, seed)


@pytest.mark.parametrize("seed", range(20))
def test_natural_sizes_are_those_in_a_turned_world(seed: int) -> None:
    """Natural length and rate of random bodies that touch are the same whatever the axes are."""
    mechanism, rpy = random_contacts(seed)[1], tuple(np.random.default_rng(seed).uniform(-3, 3, 3))
    assert natural_scale(mechanism) == natural_scale(turned_mechanism(mechanism, rpy, (0.0, 0.0, 0.0)))


@pytest.mark.one_in(2)
@pytest.mark.arithmetic
@pytest.mark.parametrize(("name", "resisted"), _cases())
def test_a_scene_with_contacts_has_the_same_truth_in_a_turned_world(name: str, resisted: bool) -> None:
    """A scene with contacts, with and without resistance, has the same truth whatever the axes are."""
    mechanism = the_mechanism(load_scene(name)).mechanism
    assert_the_same_elsewhere(with_resistance(mechanism) if resisted else mechanism, SCENES[name], len(name))


@pytest.mark.arithmetic
@pytest.mark.parametrize("seed", [pytest.param(seed, marks=NIGHTLY) for seed in range(60)])
def test_random_contacts_with_resistance_have_the_same_truth_in_a_turned_world(seed: int) -> None:
    """The same of random bodies that touch."""
    _, mechanism, until = random_contacts(seed)
    assert_the_same_elsewhere(with_resistance(mechanism), until, seed)


PLANES = [(0.0, 0.2, 0.0), (-0.4, 0.0, 1.0), (1.0, 0.7, -2.0)]


@pytest.mark.arithmetic
@pytest.mark.parametrize("rpy", PLANES)
def test_feet_at_rest_press_alike_on_turned_planes(rpy: tuple[float, float, float]) -> None:
    """Friction of three feet at rest is not determined, their normal forces are, whatever axes the plane has."""
    flat, turned = (
        MechanismTruth.truth(resting_sled(0.2, angles), np.array([0.0, 0.1]), ()) for angles in ((0.0, 0.0, 0.0), rpy)
    )
    assert np.isnan(turned["contact_forces"].to_numpy()).all()
    for name in ("normal_forces", "contact_pull", "hop_speed", "natural_map", "unpressed"):
        bar = flat[name].attrs["error_bar"] + turned[name].attrs["error_bar"]
        np.testing.assert_allclose(turned[name], flat[name], rtol=0, atol=bar, err_msg=name)
    assert float(turned["normal_forces"].min()) > 1
    assert 0 < turned["normal_forces"].attrs["error_bar"] < 1e-11


@pytest.mark.parametrize("foot", range(3))
@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), PLANES[0]])
def test_a_normal_force_is_held_where_its_friction_is_unknown(rpy: tuple[float, float, float], foot: int) -> None:
    """A published normal force that is off by 1e-6 breaks the laws of motion, though friction beside it is unknown."""
    element, times = resting_sled(0.2, rpy), np.array([0.0, 0.1])
    motion = truth_of(element.mechanism, times)
    dataset = MechanismTruth._dataset(element, motion, "")
    assert motion.tiles is not None
    assert held_answer(element, dataset, motion.tiles, times).residuals.first is None
    dataset["normal_forces"][:, foot] *= 1 + 1e-6
    broken = held_answer(element, dataset, motion.tiles, times).residuals.first
    assert broken is not None
    assert broken.law == ("newton" if any(rpy) else "spelling")


@pytest.mark.nightly
@pytest.mark.parametrize("pushes", [1.0, 1.1])
@pytest.mark.parametrize(
    "engine", ["mujoco[formulation=geoms]", "pinocchio[formulation=impulses]", "exudyn[formulation=spheres]"]
)
def test_engines_are_judged_by_what_feet_at_rest_press(engine: str, pushes: float) -> None:
    """Normal forces on a turned plane agree, and those of a gravity that is a tenth too large do not."""
    element = resting_sled(0.2, PLANES[0])
    scene = Scene("leaning", "", (element,))
    gravity = tuple(pushes * part for part in element.mechanism.gravity)
    run = simulate(
        dataclasses.replace(
            scene, elements=(MechanismElement(dataclasses.replace(element.mechanism, gravity=gravity)),)
        ),
        engine,
        until=0.2,
        every=0.02,
    )
    run.attrs.pop("scene_digest")
    judged = judge(run, scene, {"normal_forces": "1 %"})
    (found,) = [item for item in judged.compared if item.judgement.observable == "normal_forces"]
    assert found.agrees is (pushes == 1.0)
