from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from proofroll.core.certificate import EXACT, Line, Standing, certify, first_difference, not_reported
from proofroll.core.engine import Regularised
from proofroll.core.errors import Diverged
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.certificate import CAPS, another_scene
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.mechanics import (
    initial_angular_acceleration,
    initial_response,
    natural_acceleration,
)
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample
from proofroll.files.scene_file import load_scene


class Stub:
    """A built engine that holds the scene's own numbers, with some replaced."""

    def __init__(self, scene: Scene, sample: dict[str, Any] | None = None, **built: Any) -> None:
        body = rolling_ball(scene)
        acceleration, force = initial_response(body)
        right = BallBuilt(
            mass=body.ball.mass,
            inertia=np.full(3, body.ball.inertia),
            gravity=body.gravity,
            ball_radius=body.ball.radius,
            rolling_resistance=body.contact.rolling_resistance,
            acceleration=acceleration,
        )
        self._built = dataclasses.replace(right, **built)
        state = BallSample(body.p0, body.v0, body.w0, np.array([1.0, 0, 0, 0]), force)
        self._sample = dataclasses.replace(state, **(sample or {}))

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        return self._built

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        return self._sample


ALL = [
    "mass", "inertia", "gravity", "ball radius", "rolling resistance", "position", "gap", "gap in the engine",
    "velocity", "spin", "slip", "acceleration", "angular acceleration", "N", "F2", "F3",
]  # fmt: skip


def test_the_scene_itself_is_certified(scene: Scene) -> None:
    """An engine that built what the scene says passes in every quantity, and what it does not say is named."""
    lines = certify(Stub(scene), scene)
    assert [line.quantity for line in lines] == ALL
    assert not_reported([line.as_dict() for line in lines]) == ["gap in the engine", "angular acceleration"]
    assert first_difference(lines) is None


BODY = rolling_ball(load_scene("sphere_in_cylinder"))
PART = 1e-11  # relative; ten times what is allowed


@pytest.mark.parametrize(
    ("quantity", "built", "sample"),
    [
        ("mass", {"mass": 0.517 * (1 + PART)}, {}),
        ("inertia", {"inertia": BODY.ball.inertia * np.array([1, 1, 1 + PART])}, {}),
        ("gravity", {"gravity": np.array([0, 9.81 * PART, -9.81])}, {}),
        ("gravity", {"gravity": np.array([0, 0, 9.81])}, {}),
        ("ball radius", {"ball_radius": 0.025 * (1 - PART)}, {}),
        ("rolling resistance", {"rolling_resistance": 0.025 * PART}, {}),
        ("position", {}, {"p_WB": BODY.p0 + np.array([0, 0, 0.025 * PART])}),
        ("gap", {}, {"p_WB": BODY.p0 - [0.025 * PART, 0, 0]}),
        ("velocity", {}, {"v_WB": BODY.v0 * (1 + PART)}),
        ("spin", {}, {"w_WB": BODY.w0 + np.array([160 * PART, 0, 0])}),
        ("slip", {}, {"w_WB": BODY.w0 + np.array([0, 160 * PART, 0])}),
        ("acceleration", {"acceleration": initial_response(BODY)[0] * (1 + PART)}, {}),
        ("N", {}, {"force": initial_response(BODY)[1] * (1 + PART)}),
        ("F2", {}, {"force": initial_response(BODY)[1] + [0, 50 * PART, 0]}),
        ("F3", {}, {"force": initial_response(BODY)[1] + [0, 0, 50 * PART]}),
        ("mass", {"mass": np.nan}, {}),
        ("inertia", {"inertia": np.full(2, BODY.ball.inertia)}, {}),
    ],
)
def test_each_quantity_is_watched(quantity: str, built: dict[str, Any], sample: dict[str, Any]) -> None:
    """A relative difference of 1e-11 in any quantity, NaN or a wrong shape breaks the certificate, by name."""
    scene = load_scene("sphere_in_cylinder")
    lines = certify(Stub(scene, sample, **built), scene)
    broken = [line.quantity for line in lines if not line.holds]
    assert quantity in broken
    sentence = first_difference(lines)
    assert sentence is not None
    assert broken[0] in sentence


def test_a_silent_engine_is_judged_by_its_state_alone() -> None:
    """What the engine does not say is listed as not reported: it neither passes nor fails."""
    scene = load_scene("sphere_in_cylinder")
    silent = dict.fromkeys(("mass", "inertia", "gravity", "ball_radius", "rolling_resistance", "acceleration"))
    lines = certify(Stub(scene, {"force": None}, **silent), scene)
    assert [line.quantity for line in lines] == ALL
    told = [line.quantity for line in lines if line.standing is not Standing.NOT_REPORTED]
    assert told == ["position", "gap", "velocity", "spin", "slip"]
    assert {line.standing for line in lines if line.quantity in told} == {Standing.HOLDS}
    assert first_difference(lines) is None


def test_a_softened_quantity_has_its_own_tolerance_and_reason() -> None:
    """Only the quantity that the engine softens is judged by the engine's tolerance, and the reason is kept."""
    scene = load_scene("sphere_in_cylinder")
    force = initial_response(rolling_ball(scene))[1]
    soft = {"N": Regularised(1e-3, "the contact is a spring")}
    stub = Stub(scene, {"force": force * (1 + 1e-4)}, regularised=soft)
    lines = {line.quantity: line for line in certify(stub, scene)}
    assert lines["N"].holds
    assert lines["N"].because == "the contact is a spring"
    assert not lines["F3"].holds
    assert lines["F3"].tolerance == EXACT


@pytest.mark.parametrize(
    ("quantity", "built", "sample"),
    [
        ("mass", {"mass": 2 * 0.517}, {}),
        ("inertia", {"inertia": np.full(3, 2 * BODY.ball.inertia)}, {}),
        ("gravity", {"gravity": 1.5 * BODY.gravity}, {}),
        ("ball radius", {"ball_radius": 0.026}, {}),
        ("position", {}, {"p_WB": BODY.p0 + np.array([0, 0, 1e-6])}),
    ],
)
def test_what_can_never_be_softened(quantity: str, built: dict[str, Any], sample: dict[str, Any]) -> None:
    """Mass, inertia, gravity, radius and position along the wall differ, whatever softness the engine declares."""
    scene = load_scene("sphere_in_cylinder")
    soft = {quantity: Regularised(1e3, "we soften everything")}
    sentence = first_difference(certify(Stub(scene, sample, regularised=soft, **built), scene))
    assert sentence is not None
    assert f"differs from the scene: {quantity} is" in sentence
    assert "cannot be softened" in sentence


def test_depth_in_the_wall_is_the_gap() -> None:
    """A ball sunk into the wall is where the scene puts it, along the wall; only its gap is soft."""
    scene = load_scene("sphere_in_cylinder")
    sunk = Stub(scene, {"p_WB": BODY.p0 + np.array([1e-4, 0, 0])}, regularised={"gap": Regularised(0.01, "a spring")})
    assert "gap" not in [line.quantity for line in certify(sunk, scene) if not line.holds]
    assert "position" not in [line.quantity for line in certify(sunk, scene) if not line.holds]


@pytest.mark.parametrize("quantity", [name for name in CAPS if not name.startswith("1 / ")])
def test_softness_is_capped(quantity: str) -> None:
    """An engine that asks for more softness than any reason explains gets no more than that, with both reasons."""
    scene = load_scene("sphere_in_cylinder", rolling_resistance=5e-4)
    soft = {quantity: Regularised(float("inf"), "our model is soft")}
    turning = initial_angular_acceleration(rolling_ball(scene))
    stub = Stub(scene, gap=0.0, angular_acceleration=turning, regularised=soft)
    line = next(line for line in certify(stub, scene) if line.quantity == quantity)
    assert line.tolerance == CAPS[quantity].tolerance <= 1
    assert "our model is soft" in line.because
    assert CAPS[quantity].because in line.because


def test_a_number_for_unbounded_friction_is_another_scene_where_more_is_needed() -> None:
    """A model with a friction of 1 is of another kind where the unbounded scene needs 1.17, and of the same at 0.9."""
    scene = load_scene("sphere_in_cylinder")
    soft = {"1 / static friction": Regularised(1.0, "the engine needs a number")}
    lines = [line.as_dict() for line in certify(Stub(scene, mu_static=1.0, regularised=soft), scene)]
    assert another_scene(lines, 0.9) is None
    assert another_scene(lines, 1.17) == ("another scene: a friction of 1, where the scene has no bound and needs 1.17")
    for mu in (None, np.inf):
        unbounded = [line.as_dict() for line in certify(Stub(scene, mu_static=mu), scene)]
        assert another_scene(unbounded, 1.17) is None


def test_the_sentence_names_the_first_difference() -> None:
    """The refusal shows quantity, both values, unit and both differences."""
    good = Line("mass", "kg", (1.0,), (1.0,), 0.0, EXACT)
    bad = Line("gravity", "m/s^2", (0.0, 0.0, -9.81), (0.0, 0.0, -9.8), 1e-3, EXACT)
    assert first_difference([good, bad, bad]) == (
        "the engine's model differs from the scene: gravity is 0, 0, -9.8 instead of 0, 0, -9.81 m/s^2 "
        "(relative difference 1e-3, allowed 1e-12)"
    )


def test_a_number_in_single_precision_is_told_apart_from_the_one_it_was() -> None:
    """Two numbers that differ are never shown alike, and the reason is named where it is single precision."""
    single = Line("gap", "m", (0.2,), (float(np.float32(0.2)),), 1.5e-8, EXACT)
    sentence = first_difference([single])
    assert sentence is not None
    assert "gap is 0.200000003 instead of 0.2 m" in sentence
    assert "in single precision (float32)" in sentence


RESISTED = load_scene("sphere_in_cylinder", rolling_resistance=5e-4)
TURNING = initial_angular_acceleration(rolling_ball(RESISTED))
ANGULAR = natural_acceleration(rolling_ball(RESISTED)) / 0.025


def test_a_velocity_is_measured_by_all_that_makes_it() -> None:
    """A ball that spins fast and goes slowly has its velocity from contact and spin: their roundings are no lie."""
    scene = load_scene("sphere_in_cylinder", speed=1e-4, radial_spin=213.7)
    body = rolling_ball(scene)
    rounded = body.v0 + np.array([0, 1e-6, 0])  # two roundings of the 5 m/s with which the ball's sides move
    single = SimpleNamespace(precision="single")
    lines = certify(Stub(scene, {"v_WB": rounded}), scene, single)
    assert [line.quantity for line in lines if not line.holds] == []
    wrong = body.v0 + np.array([0, 1e-3, 0])
    assert "velocity is" in str(first_difference(certify(Stub(scene, {"v_WB": wrong}), scene, single)))
    assert "velocity is" in str(first_difference(certify(Stub(scene, {"v_WB": rounded}), scene)))


def test_resistance_and_angular_acceleration_are_certified() -> None:
    """An engine that built the scene's resistance passes, and both have their line."""
    lines = certify(Stub(RESISTED, angular_acceleration=TURNING), RESISTED)
    assert first_difference(lines) is None
    assert {"rolling resistance", "angular acceleration"} <= {line.quantity for line in lines}


@pytest.mark.parametrize(
    ("quantity", "built"),
    [
        ("rolling resistance", {"rolling_resistance": None}),
        ("rolling resistance", {"rolling_resistance": 0.0}),
        (
            "angular acceleration",
            {"angular_acceleration": TURNING + np.array([0, 0, PART * ANGULAR])},
        ),
        ("angular acceleration", {"angular_acceleration": -TURNING}),
    ],
)
def test_resistance_is_watched(quantity: str, built: dict[str, Any]) -> None:
    """What the scene requires and the engine does not read back, or reads back otherwise, fails in one sentence."""
    lines = certify(Stub(RESISTED, **({"angular_acceleration": TURNING} | built)), RESISTED)
    assert [line.quantity for line in lines if not line.holds] == [quantity]
    sentence = first_difference(lines)
    assert sentence is not None
    silent = any(value is None for value in built.values())
    expected = f"does not say its {quantity}" if silent else f"differs from the scene: {quantity} is "
    assert sentence.startswith(f"the engine's model {expected}")
    assert "\n" not in sentence


def test_friction_that_the_scene_does_not_bound() -> None:
    """Where the scene has no bound, an engine without one passes, and one with a number of its own does not."""
    scene = load_scene("sphere_in_cylinder")
    assert first_difference(certify(Stub(scene, mu_static=np.inf, mu_kinetic=np.inf), scene)) is None
    for mu in (0.0, 1.0, 1e9):
        sentence = first_difference(certify(Stub(scene, mu_static=mu), scene))
        assert sentence is not None
        assert "1 / static friction" in sentence


@pytest.mark.parametrize("wrong", [np.zeros((2, 3)), "heavy", [1.0, [2.0]]], ids=["shape", "text", "ragged"])
@pytest.mark.parametrize(
    "name", [item.name for item in dataclasses.fields(BallBuilt) if item.name not in {"terms", "regularised"}]
)
def test_what_is_built_of_another_shape_is_named(name: str, wrong: Any) -> None:
    """Whatever an engine says that it built is of the shape that the protocol says, or the field is named."""
    scene = load_scene("sphere_in_cylinder")
    with pytest.raises(Diverged, match=rf"^the engine's built\(\) gave {name}( with shape|, which is no array)"):
        certify(Stub(scene, **{name: wrong}), scene)
