"""Each conformance check fails on some engine that is broken on purpose, and none fails on one that is not."""

from __future__ import annotations

import dataclasses
import math
import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any, ClassVar, Self
from unittest import SkipTest

import numpy as np
import pytest
from honest import Rolling
from liars import of_mechanism
from lies import gravity, heavier
from nonconforming import FAILS, Damped, Drifting, Forgetful, Heavy, OneBuffer, OneForAll, Secretly, Views
from placed_balls import placed, scene_with
from single_precision import Single
from tiny import Tiny, TinySettings

from proofroll.conformance import Check, checks, motion, run_check
from proofroll.core.errors import InputError, Refused
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.sampling import BallSample
from proofroll.running.simulation import simulate


@pytest.fixture(autouse=True)
def tiny_is_installed(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """The conforming engine's entry point."""
    install_engines({"tiny": "tiny:Tiny"})


def failure(engine: type[Tiny], family: str) -> str:
    """Text of the first check of one family that fails; empty if none does."""
    for check in checks(engine):
        if check.name.partition("[")[0] != family:
            continue
        try:
            check()
        except AssertionError as error:
            return str(error)
        except SkipTest:
            pass
    return ""


@pytest.mark.parametrize("check", checks(Tiny))
def test_a_conforming_engine_passes(check: Check) -> None:
    """An engine that keeps every promise fails no check."""
    check()


class Late(Tiny):
    """Defines reactions only after a first step."""

    def sample(self) -> BallSample:
        """No force at time 0."""
        right = super().sample()
        return right if self.t else dataclasses.replace(right, force=None)


def test_an_engine_without_a_force_at_time_0_conforms() -> None:
    """Reactions that begin with the first step break no promise about what is built, sampled and moved."""
    for family in (
        "certificate_holds",
        "samples_are_well_formed",
        "reading_back_changes_nothing",
        "moves_as_the_truth",
    ):
        assert failure(Late, family) == ""


@pytest.mark.one_in(3)
@pytest.mark.drill_of("Damped-first_steps_fit_the_scene", "Beating-moves_as_the_truth")
@pytest.mark.parametrize(("engine", "family"), FAILS.items(), ids=lambda value: getattr(value, "__name__", value))
def test_each_broken_promise_is_noticed(engine: type[Tiny], family: str) -> None:
    """The check whose business it is fails, and says how to run it alone."""
    text = failure(engine, family)
    assert text, f"{family} did not notice: {engine.__doc__}"
    assert f"from nonconforming import {engine.__name__}" in text
    assert f"run_check({engine.__name__}, '{family}" in text


@pytest.mark.parametrize("engine", [Views, OneBuffer, OneForAll])
def test_a_buffer_that_is_filled_anew_is_named(engine: type[Tiny]) -> None:
    """Whoever fills the arrays of a sample again, by a step or the next sample, reads that copies are missing."""
    text = failure(engine, "reading_back_changes_nothing")
    assert text.startswith("the arrays of a sample change with later steps: return copies")


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize("engine", [Views, OneBuffer, OneForAll])
def test_a_buffer_that_is_filled_anew_spoils_no_run(engine: type[Tiny]) -> None:
    """A run of such an engine is that of one that returns copies, and its model is not called a wrong one."""
    ran, right = (simulate("sphere_in_cylinder", kind, until=0.1) for kind in (engine, Tiny))
    for name in ("p_WB", "v_WB", "w_WB", "N"):
        assert ran[name].to_numpy().tolist() == right[name].to_numpy().tolist()


def test_a_precision_that_is_not_told_is_the_first_failure() -> None:
    """The first check that fails of an engine in single precision that does not say so names the setting it lacks."""
    families = dict.fromkeys(check.name.partition("[")[0] for check in checks(Secretly))
    families.pop("name_is_the_entry_point")
    first, text = next((family, text) for family in families if (text := failure(Secretly, family)))
    assert first == "samples_are_well_formed"
    assert 'settings of the engine must say precision = "single"' in text


def test_no_order_is_told_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps that differ by round-off alone are called that, where others show no order either."""
    orders = iter([(math.nan, math.nan), (2.71, 2.87), (math.nan, math.nan)])
    monkeypatch.setattr(motion, "_orders", lambda *_: next(orders))
    said = failure(Tiny, "order_is_as_declared")
    assert "none is observed: no more than round-off at dt = 0.004; 2.71, 2.87 at dt = 0.008" in said
    assert "nan" not in said


@pytest.mark.drill
def test_a_scale_is_named() -> None:
    """An error that is told relative to a scale names the number of the scale, and the error itself, with units."""
    text = failure(Drifting, "moves_as_the_truth")
    found = re.match(r"p_WB is off by (\S+) m, (\S+) of its scale in a run of 0.1 s, (\S+) m; allowed \S+", text)
    assert found
    error, part, scale = map(float, found.groups())
    assert error == pytest.approx(part * scale, rel=0.1)


def test_every_check_is_known_to_be_able_to_fail() -> None:
    """There is no check without an engine that fails it."""
    assert {check.name.partition("[")[0] for check in checks(Tiny)} == set(FAILS.values())


@pytest.mark.nightly
def test_the_reproducer_runs() -> None:
    """The printed command, pasted into a shell, fails for the same reason."""
    check = next(check for check in checks(Forgetful) if check.name.startswith("advance_in_two_parts"))
    with pytest.raises(AssertionError) as caught:
        check()
    command = str(caught.value).rpartition("To reproduce:\n")[2]
    assert command.startswith('python -c "')
    done = subprocess.run(
        [sys.executable, "-c", command.removeprefix('python -c "').removesuffix('"')],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert str(caught.value).partition("\n")[0] in done.stderr


def test_a_known_failure_is_skipped_with_its_reason() -> None:
    """A check that is known to fail is skipped, and the reason is shown."""
    check = next(c for c in checks(Heavy, {"certificate_holds[*-cylinder]": "it is heavy"}) if c.known)
    with pytest.raises(SkipTest, match="known: it is heavy"):
        check()


def test_a_known_failure_that_passes_is_a_failure() -> None:
    """Nobody keeps an excuse that is no longer needed."""
    check = next(c for c in checks(Tiny, {"version_is_told": "no version yet"}) if c.known)
    with pytest.raises(AssertionError, match="take it off the list"):
        check()


def test_names_that_fit_nothing() -> None:
    """A misspelt check is an error rather than silence."""
    with pytest.raises(ValueError, match="no check of Tiny fits 'versoin'"):
        checks(Tiny, {"versoin": "misspelt"})
    with pytest.raises(ValueError, match="has no check"):
        run_check(Tiny, "versoin")


def moved_centre(scene: Scene) -> Scene:
    """The scene with the first body's centre of mass a tenth farther out."""
    (element,) = scene.elements
    first, *others = element.mechanism.bodies  # type: ignore[attr-defined]  # it is a mechanism
    return of_mechanism(scene, bodies=(dataclasses.replace(first, com=1.1 * np.asarray(first.com)), *others))


def moved_joint(scene: Scene) -> Scene:
    """The scene with the last joint a tenth farther out on both bodies."""
    (element,) = scene.elements
    *others, last = element.mechanism.joints  # type: ignore[attr-defined]  # it is a mechanism
    ends = {end: tuple(1.1 * np.asarray(getattr(last, end))) for end in ("position", "child_position")}
    return of_mechanism(scene, joints=(*others, dataclasses.replace(last, **ends)))


def larger(scene: Scene) -> Scene:
    """The scene with a ball whose radius is a tenth larger."""
    ball = placed(scene).ball
    return scene_with(scene, ball=dataclasses.replace(ball, radius=1.1 * ball.radius))


MODELS: Mapping[str, Callable[[Scene], Scene]] = {
    "none": lambda scene: scene,
    "gravity": gravity(1.1),
    "mass": heavier("mass", 1.1),
    "inertia": heavier("inertia", 1.1),
    "centre": moved_centre,
    "joint": moved_joint,
    "radius": lambda scene: scene_with(
        scene, ball=dataclasses.replace(ball := placed(scene).ball, radius=1.1 * ball.radius)
    ),
}


def lying(engine: type[Any], model: Callable[[Scene], Scene]) -> type[Any]:
    """An engine that moves another model than it says it has built."""

    class Lying(engine):  # type: ignore[misc]  # any engine
        @classmethod
        def build(cls, scene: Scene, settings: Any) -> Any:
            moves, right = engine.build(model(scene), settings), engine.build(scene, settings)
            moves.built = right.built
            return moves

    return Lying


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("engine", "formulation", "lies"),
    [
        (Single, "euler-matched-double_pendulum", ("gravity", "mass", "inertia", "centre", "joint")),
        (Single, "euler-matched-falling_body", ("gravity", "centre")),  # falls alike at any mass
        (Rolling, "order_1-matched-slow", ("gravity", "inertia", "radius")),  # rolls alike at any mass
    ],
)
def test_another_model_than_is_said_is_noticed(engine: type[Any], formulation: str, lies: tuple[str, ...]) -> None:
    """An engine of first order fails by its first steps where gravity, mass, inertia or geometry is off by a tenth."""
    name = f"first_steps_fit_the_scene[{formulation}]"
    for lie in ("none", *lies):
        (own,) = [check for check in checks(lying(engine, MODELS[lie])) if check.name == name]
        with pytest.raises(AssertionError, match="differs from the scene") if lie in lies else nullcontext():
            own.run()


@pytest.mark.drill
def test_another_top_than_is_said_is_noticed() -> None:
    """A slow top shows a centre of mass that is off by a tenth in an engine of spherical joints and first order."""
    pytest.importorskip("mujoco")
    name = "first_steps_fit_the_scene[joints-default-slow_top]"
    for lie in ("none", "gravity", "mass", "inertia", "centre"):
        (own,) = [check for check in checks(lying(load_engine("mujoco"), MODELS[lie])) if check.name == name]
        with nullcontext() if lie == "none" else pytest.raises(AssertionError, match="differs from the scene"):
            own.run()


class Weary(Damped):
    """Damped, and gives up with an error of its own where it runs for longer than the checks do."""

    def advance(self, t: float) -> None:
        """No further than a fiftieth of a second."""
        if t > 0.02:
            raise RuntimeError("the licence has run out")
        super().advance(t)


def test_an_engine_that_fails_where_the_cause_is_looked_for() -> None:
    """What the check has found is told, and how to run it alone, with what came in between of the cause."""
    text = failure(Weary, "first_steps_fit_the_scene")
    assert text.startswith("the engine's model differs from the scene: acceleration of the first steps")
    assert "no cause was found: RuntimeError: the licence has run out" in text
    assert "To reproduce:" in text


_COARSE = 2.5e-3


@dataclass(frozen=True)
class BoundedSettings(TinySettings):
    """Steps up to 2.5 ms."""

    def __post_init__(self) -> None:
        if self.dt > _COARSE:
            raise InputError("bounded: dt", self.dt, "at most 2.5 ms")


class Bounded(Tiny):
    """Takes no coarser step."""

    settings = BoundedSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"midpoint": {"matched": BoundedSettings()}}


class Refusing(Tiny):
    """Builds nothing with a coarser step."""

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:
        """Refuses it."""
        if settings.dt > _COARSE:
            raise Refused("this step is too coarse")
        return super().build(scene, settings)


class Exploding(Tiny):
    """Loses its state with a coarser step, and says nothing."""

    def advance(self, t: float) -> None:
        """No number is left of it."""
        super().advance(t)
        if self.dt > _COARSE:
            self.x = np.full(5, np.nan)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("engine", [Bounded, Refusing, Exploding])
def test_the_order_of_an_engine_that_takes_no_coarse_steps(engine: type[Tiny]) -> None:
    """Where there are no steps coarser than the preset's the order is seen with finer ones, and a wrong one too."""
    assert failure(engine, "order_is_as_declared") == ""
    wrong = type(f"{engine.__name__}Settings", (engine.settings,), {"order": 4})
    liar = type(engine.__name__, (engine,), {"settings": wrong, "presets": {"midpoint": {"matched": wrong()}}})
    assert "the observed one 1.9" in failure(liar, "order_is_as_declared")
