"""Lies around an honest engine are found out, whatever they are about; honest engines are not accused."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, ClassVar

import numpy as np
import pytest
from flat_judging import judged_curve
from honest import FORMULATIONS, ORDERS, Jointed, Rolling, Switching
from liars import ALL, BALLS, EVERY, MECHANISMS, UNTIL, Lie, liar, scene_of
from lies import ORDER, table
from tiny import Tiny, TinySettings

from proofroll.core.convergence import richardson, tightest
from proofroll.core.dataset import BETWEEN
from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene
from proofroll.core.errors import Diverged, InputError, Refused
from proofroll.core.events import Event, events_of, with_events
from proofroll.core.first_steps import certificate
from proofroll.core.multi_element import build
from proofroll.core.observable import Role
from proofroll.core.plugins import resolve_settings
from proofroll.core.scene import Scene
from proofroll.core.verdict import Allowance, Judgement, LimitResult, Refinement, RunCurve, Verdict, judge_curve
from proofroll.files.scene_file import load_scene
from proofroll.running import time_case
from proofroll.running.recording import record
from proofroll.running.simulation import simulate
from proofroll.running.time_case import clean_runs
from proofroll.studies.answer.judged_run import errors_of
from proofroll.studies.comparison.default_comparison import bounds
from proofroll.studies.judging import judge as judging
from proofroll.studies.judging import run_values
from proofroll.studies.judging.judge import judge as judge_run
from proofroll.studies.judging.reference import Reference

# A truth of its own at other times, of what switches.
SLOW = {"a clock 1 % slow", "a clock 1 % slow from the start of a slide"}
# Each lie is told of one scene: every other one in every run of the tests, every fourth at night alone. It is told of
# one of the other kind in the drills, every sixth one before a change lands: joints and contacts have code of their
# own, scenes of one kind have not. Scenes of a kind take turns, so that each has many.
KINDS = (MECHANISMS, (*BALLS, "sled"))


def told(lie: Lie, place: int) -> dict[str, tuple[pytest.MarkDecorator, ...]]:
    """Scenes of which a lie is told, with their marks."""
    first = lie.scenes[place % len(lie.scenes)]
    others = [[about for about in kind if about in lie.scenes] for kind in KINDS if first not in kind]
    mark = pytest.mark.nightly if place % 6 else pytest.mark.drill
    drills = dict.fromkeys((kind[place % len(kind)] for kind in others if kind), (mark,))
    again = pytest.mark.nightly if place % 4 == 3 else pytest.mark.drill
    return {first: (again,) if place % 2 or lie.name in SLOW else ()} | drills


@pytest.fixture(scope="module", autouse=True)
def known_slips() -> None:
    """Finds the truth of the scene that slips for all its lies."""
    run = simulate(scene_of("slips"), liar("slips", Lie("nothing", ("slips",))), until=UNTIL["slips"], every=EVERY)
    judge_run(run, scene_of("slips"))


LIES = [
    pytest.param(about, lie, id=f"{about}-{lie.name}", marks=marks)
    for place, lie in enumerate(table())
    for about, marks in told(lie, place).items()
]
# What is judged: all that an honest run gives, and its state.
_STATE = ("v_WB", "w_WB", "q_WB")


@dataclass(frozen=True)
class Heard:
    """What is said of a run: that it agrees in all, or what is wrong; causes; and what an answer measures of it.

    That is its error of each observable in parts of its size, infinite where it has none; empty: there is no point.
    """

    agrees: bool
    words: str
    causes: tuple[str, ...] = ()
    errors: dict[str, float] = field(default_factory=dict, compare=False)


def hear(scene: Scene, kind: Any, band: dict[str, str], until: float, **settings: Any) -> Heard:
    """Runs an engine as a user does, and judges all of it."""
    try:
        run = simulate(scene, kind, until=until, every=EVERY, **settings)
        if run.attrs["status"] != "done":
            return Heard(False, str(run.attrs["message"]))
        found = judge_run(run, scene, band)
    except (Refused, Diverged, InputError) as error:
        return Heard(False, str(error))
    wrong = [item for item in found.compared if not item.agrees or item.judgement.remarks]
    return Heard(
        not wrong,
        "\n".join(map(str, wrong)),
        _causes(scene, kind, run, [item.judgement for item in found.compared], settings),
        _errors(scene, run, band),
    )


def _errors(scene: Scene, run: Any, asked: Iterable[str]) -> dict[str, float]:
    reference = Reference.of(scene, _true(scene, run))
    errors, *_ = errors_of(run, reference, whole=True)
    known = [name for name in asked if name in reference.curves]
    return {name: errors.get(name, np.inf) / (reference.scale(name) or 1.0) for name in known}


def _causes(
    scene: Scene, kind: Any, run: Any, judgements: Sequence[Judgement], settings: dict[str, Any]
) -> tuple[str, ...]:
    chosen = resolve_settings(kind, settings, scene.requires)
    lines = [line.as_dict() for line in certificate(kind, kind.build(scene, chosen), scene, chosen)]
    step = getattr(chosen, chosen.resolution) if chosen.resolution == "dt" else None
    return tuple(item.sentence for item in diagnose_scene(scene, lines, run, _true(scene, run), step, judgements))


def _true(scene: Scene, run: Any) -> Any:
    """The truth at the times of a run, as its judge has computed it."""
    times, between = run["time"].to_numpy(), run[BETWEEN].to_numpy() if BETWEEN in run else np.zeros(0)
    return judging._truth(scene.fully_asked if "q_WB" in run else scene, times, between)


@cache
def band_of(about: str) -> dict[str, str]:
    """0.1 % of all that an honest run of a scene gives, and 1 % of what has to be zero."""
    scene = scene_of(about)
    run = simulate(scene, liar(about, Lie("nothing", (about,))), until=UNTIL[about], every=EVERY)
    true = _true(scene, run)
    reference = Reference.of(scene, true)
    given = [*run_values.observables_of(reference, run), *(name for name in _STATE if name in run and name in true)]
    # the work of a servo that leaves its limit between two samples is a quadrature over a jump
    given = [name for name in given if name != "work.effort.servo"]
    items = {name: scene.observables.get(name) for name in given}
    return {name: "1 %" if item and item.role is Role.RESIDUAL else "0.1 %" for name, item in items.items()}


@pytest.mark.drill
@pytest.mark.one_in(8)
@pytest.mark.drill_of("loop-3 ms early")
@pytest.mark.parametrize(("about", "lie"), LIES)
def test_a_lie(about: str, lie: Lie) -> None:
    """It is found out, and what is said names what it is about; one far below the tolerance is none."""
    heard = hear(scene_of(about), liar(about, lie), band_of(about), UNTIL[about])
    if not lie.said:
        assert heard.agrees, heard
        assert not heard.causes
        assert max(heard.errors.values()) < 1e-3
        return
    assert not heard.errors or lie.said == ORDER or max(heard.errors.values()) > 1e-3, heard
    assert not heard.agrees
    assert any(word in heard.words for word in lie.said), heard
    assert not [cause for cause in heard.causes[:1] if cause.startswith("or, ")]  # than nothing
    for cause in heard.causes:
        assert any(word in cause for word in lie.causes), cause


UNASKED = [
    ("rolls", "quaternions of the start", "q_WB is"),
    ("loop", "quaternions of another body", "q_WB is"),
    ("rolls", "v + 7 m/s between samples", "v_WB is"),
    ("rolls", "spins x 3 between samples", "w_WB is"),
    ("tree", "moments + 5 N m", "torques are"),
    ("bounces", "right on the grid alone, an impact in each interval", "positions are"),
    ("slips", "nothing", "not judged: event_times, event_order; no tolerance is given"),
]


@pytest.mark.one_in(3)
@pytest.mark.parametrize(("about", "name", "words"), UNASKED)
def test_a_lie_where_nobody_says_what_is_judged(about: str, name: str, words: str) -> None:
    """Without a tolerance a lie about states or reactions is found, and events that are not judged are named."""
    lie = next((lie for lie in table() if lie.name == name), Lie(name, (about,)))
    run = simulate(scene_of(about), liar(about, lie), until=UNTIL[about], every=EVERY)
    found = judge_run(run, scene_of(about))
    assert words in str(found)
    assert found.agrees is ("not judged" in words)


def test_a_bracket_that_ends_before_it_begins_is_named() -> None:
    """An event's bracket with swapped ends is no bracket: the engine's run fails by name, a user's is refused."""
    swaps = Lie("swapped", ("slips",), events=lambda right, _: [swap(event) for event in right])
    run = simulate(scene_of("slips"), liar("slips", swaps), until=UNTIL["slips"], every=EVERY)
    assert run.attrs["status"] == "diverged"
    assert "time_low comes before time_high" in run.attrs["message"]
    honest = simulate(scene_of("slips"), liar("slips", Lie("nothing", ("slips",))), until=UNTIL["slips"], every=EVERY)
    given = with_events(honest, [swap(event) for event in events_of(honest)])
    with pytest.raises(InputError, match="time_low comes before time_high"):
        judge_run(given, scene_of("slips"))


def swap(event: Event) -> Event:
    """The event with the ends of its bracket swapped, 1 ms apart."""
    return replace(event, time_low=event.time + 5e-4, time_high=event.time - 5e-4)


def first_look(about: str) -> dict[str, str]:
    """Tolerances of a comparison about which no file says anything."""
    found = bounds(scene_of(about), EVERY)
    return {
        name: f"{100 * item.value} %" if item.relative else f"{item.value} {item.unit}" for name, item in found.items()
    }


@pytest.mark.parametrize("about", ALL)
def test_the_truth_told_is_believed(about: str) -> None:
    """The engine around which the lies are agrees in all that is judged, without a remark and without a cause."""
    assert len(band_of(about)) >= 9
    heard = hear(scene_of(about), liar(about, Lie("nothing", (about,))), band_of(about), UNTIL[about])
    assert heard == Heard(True, "")


# Scenes of honest engines -> parameters; those of balls first.
ROLL: dict[str, dict[str, float]] = {
    "sphere_in_cylinder": {"axial_speed": 0.7, "radial_spin": 12.0, "rolling_resistance": 5e-4},
}  # fmt: skip
# A servo that leaves its limit at 0.016 s, a mass that hits its stop at 0.09 s, and a sled that slides.
SWITCH: dict[str, Callable[[], Scene]] = {
    "servo": lambda: scene_of("servo"),
    "stop": lambda: load_scene("stop", height=0.04, restitution=0.5),
    "sled": lambda: scene_of("sled"),
}
SWING = ("double_pendulum", "pendulum", "oscillators", "gyroscope_cart", "driven", "chain")
FACTORS = (1.0, 0.5, 0.25)
# Runs of them take seconds.
LONG = {"chain", "gyroscope_cart", "servo", "sled"}
NIGHTLY = (pytest.mark.nightly,)


def _marks(scene: str, index: int, place: int) -> tuple[pytest.MarkDecorator, ...]:
    if place == (index + 1) % len(FORMULATIONS):
        return (pytest.mark.drill,) if scene in LONG else ()
    return NIGHTLY if scene in LONG else (pytest.mark.drill,)


# Every method on a ball and on a tree, and two of them on each other scene, one of which in every run of the tests.
HONEST = [
    pytest.param(scene, formulation, marks=_marks(scene, index, place))
    for scenes in (tuple(ROLL), SWING, tuple(SWITCH))
    for index, scene in enumerate(scenes)
    for place, formulation in enumerate(FORMULATIONS)
    if index == 0 or (place - index) % len(FORMULATIONS) in {0, 1}
]
# Methods of other kinds, on a loop, at a joint's laws and in contact: one of them on each before a change lands.
FIRST: dict[str, tuple[pytest.MarkDecorator, ...]] = {
    "stop-semi_implicit": (),
    "loop-multistep": (pytest.mark.drill,),
    "servo-implicit": (pytest.mark.drill,),
    "sled-implicit_euler": (pytest.mark.drill,),
}
HONEST += [
    pytest.param(scene, formulation, marks=FIRST.get(f"{scene}-{formulation}", NIGHTLY))
    for scene in ("loop", *SWITCH)
    for formulation in ORDERS
]
# Springs, which implicit Euler damps by half of their stiffness times the step.
HONEST.append(pytest.param("oscillators", "implicit_euler", marks=pytest.mark.drill))


def _honest_scene(name: str) -> tuple[Scene, Any]:
    if name in ROLL:
        return load_scene(name, **ROLL[name]), Rolling
    if name in SWITCH:
        return SWITCH[name](), Switching
    return scene_of(name) if name in UNTIL else load_scene(name), Jointed


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.nightly_of(
    "sled-implicit_euler",
    "chain-order_1",
    "oscillators-implicit_euler",
    "gyroscope_cart-adaptive",
    "double_pendulum-adaptive",
    "double_pendulum-order_1",
    "double_pendulum-mixed",
    "oscillators-order_3",
    "sphere_in_cylinder-adaptive",
    "sphere_in_cylinder-order_1",
    "servo-implicit",
)
@pytest.mark.drill_of("oscillators-order_4")
@pytest.mark.parametrize(("name", "formulation"), HONEST)
def test_an_honest_engine(name: str, formulation: str) -> None:
    """A textbook method is not accused at a coarse step, nor its limit of small steps, and no cause is told."""
    scene, kind = _honest_scene(name)
    step = {"rtol": 1e-6} if formulation == "adaptive" else {"dt": 5e-3}
    ((field, coarse),) = step.items()
    factors = FACTORS if field == "dt" else (1.0, 0.1, 0.01)
    runs = {
        factor: simulate(scene, kind, until=0.15, every=EVERY, formulation=formulation, **{field: coarse * factor})
        for factor in factors
    }
    assert {run.attrs["status"] for run in runs.values()} == {"done"}
    reference = Reference.of(scene, _true(scene, runs[1.0]))
    curves = {factor: run_values.observables_of(reference, run) for factor, run in runs.items()}
    judgements = []
    for item, curve in curves[1.0].items():
        ladder = [curves[factor][item] for factor in factors]
        order = kind.presets[formulation]["matched"].order
        limit = richardson(ladder, factors, order) if field == "dt" else tightest(ladder)
        smallest = coarse * factors[-1] if field == "dt" else None
        limit = replace(limit, beside=reference.beside(item, limit.values, runs[factors[-1]], smallest))
        size = reference.sizes.get(item, 1.0)
        allowance = Allowance(item, scene.observables[item].unit, 0.01 * size, size)
        off_grid, magnitude = run_values.values_off_grid(reference, item, runs[1.0]), reference.magnitude(item)
        own = RunCurve(curve, between=off_grid, magnitude=magnitude)
        judgements.append(judge_curve(allowance, own, reference.true(item, curve), Refinement(limit, ladder=True)))
    assert not [item for item in judgements if item.limit is LimitResult.ANOTHER or item.remarks]
    # where the coarse steps show no limit, as of the chain, a difference is none of the model
    assert {item.limit for item in judgements if item.verdict is Verdict.DIFFERS} <= {LimitResult.NOT_SHOWN}
    assert not _causes(scene, kind, runs[1.0], judgements, {"formulation": formulation, **step})


# Ladders of lies: error of a run over the tolerance, by its step over that of the row.
LADDERS: dict[str, Callable[[float], float]] = {
    "right at the row's step alone": lambda h: 10.0 * (h != 1),
    "another limit, which the row's own error cancels": lambda h: 3 * (h - 1),
    "another limit within the tolerance": lambda _: 0.5,
    "another limit within the tolerance, at first order": lambda h: 0.4 + 0.01 * h,
    "another limit beyond it": lambda _: 2.0,
    "worse at smaller steps": lambda h: 0.4 / h,
    "the finest of all alone wrong": lambda h: 5.0 * (h == 0.25),
    "another at each step": lambda h: 5 * math.sin(40 * h) * (h != 1),
}
_STEPS = (1.0, 0.5, 0.25)
_GRID = np.linspace(0.0, 1.0, 51)


def _laddered(error: Callable[[float], float], order: int) -> Judgement:
    true = np.sin(5 * _GRID)
    curves = {h: true + 0.01 * error(h) * np.cos(3 * _GRID) for h in _STEPS}
    limit = richardson(list(curves.values()), _STEPS, order)
    bars = {"truth_error_bar": 1e-12, "tolerance": 0.01, "scale": 1.0}
    return judged_curve("z", "m", curves[1.0], true, limit=limit, ladder=True, **bars)


@pytest.mark.parametrize("name", LADDERS)
def test_a_ladder_of_lies(name: str) -> None:
    """Runs that are right at the row's own step alone, or tend to another limit, are not plainly called to agree."""
    for order in (1, 4):
        found = _laddered(LADDERS[name], order)
        assert found.verdict is not Verdict.AGREES or found.remarks


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_an_honest_ladder(order: int) -> None:
    """Errors of a method's order agree without a remark, and none at all does, too."""
    for error in (lambda h: 0.1 * h**order, lambda _: 0.0):
        found = _laddered(error, order)
        assert (found.verdict, found.remarks) == (Verdict.AGREES, ())


class PutOff(Tiny):
    """Notes the time and moves in the sample."""

    def advance(self, t: float) -> None:
        """Nothing yet."""
        self.until = t

    def sample(self) -> Any:
        """All that was put off, and the 0.1 s of a hard step."""
        if getattr(self, "until", 0.0) > self.t:
            time.sleep(0.1)
            super().advance(self.until)
        return super().sample()


class OnlyLookedAt(Tiny):
    """Takes one step wherever it is not looked at right after."""

    looked = True

    def advance(self, t: float) -> None:
        """Honest steps, or one."""
        if self.looked:
            super().advance(t)
        else:
            self.x, self.t = self.x + (t - self.t) * self.rates(self.x), t
        self.looked = False

    def sample(self) -> Any:
        """Notes that it is looked at."""
        self.looked = True
        return super().sample()


@pytest.mark.parametrize(
    ("kind", "cost", "said"), [(Tiny, 0.0, ""), (PutOff, 0.1, ""), (OnlyLookedAt, np.inf, "no speed")]
)
def test_a_cost_that_is_faked(kind: type[Tiny], cost: float, said: str) -> None:
    """Work that is left to samples counts, and an engine that saves its work where it is not sampled has no speed."""
    scene, settings = load_scene("sphere_in_cylinder"), TinySettings()
    found = clean_runs(kind, scene, settings, record(build(kind, scene, settings), scene, np.linspace(0, 0.1, 11)))
    assert min(found.rates, default=np.inf) >= cost
    assert any(said in remark for remark in found.remarks) is bool(said)


class Remembers(Tiny):
    """Runs once, and looks up the same run from then on."""

    kept: ClassVar[dict[float, Any]] = {}

    def advance(self, t: float) -> None:
        """Slow steps, or what is known."""
        if t not in self.kept:
            while self.t < t:
                super().advance(min(t, self.t + 1e-4))
            self.kept[t] = self.x
        self.x, self.t = self.kept[t], t


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.drill_of("Tiny-0")
@pytest.mark.parametrize(("kind", "remarks"), [(Tiny, 0), (Remembers, 1)])
def test_a_run_that_is_remembered(kind: type[Tiny], remarks: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """An engine whose first run, the judged one, costs ten times as much as later ones has a speed with a remark."""
    monkeypatch.setattr(time_case, "_LONG_SECONDS", 1e-4)
    monkeypatch.setattr(Remembers, "kept", {})
    scene, settings = load_scene("sphere_in_cylinder"), TinySettings(dt=1e-4)
    clean_runs(Tiny, scene, settings, record(build(Tiny, scene, settings), scene, np.linspace(0, 0.1, 11)))  # warm
    found = clean_runs(kind, scene, settings, record(build(kind, scene, settings), scene, np.linspace(0, 0.5, 51)))
    assert sum("times as long as the timed ones" in remark for remark in found.remarks) == remarks


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("about", ALL)
def test_places_alone(about: str) -> None:
    """Who gives places and nothing else is judged by them, right or 3 ms late."""
    for lie, agrees in (
        (Lie("nothing", (about,)), True),
        (next(lie for lie in table() if lie.name == "3 ms late"), False),
    ):
        run = simulate(scene_of(about), liar(about, lie), until=UNTIL[about], every=EVERY)
        places = {name: run[name].to_numpy() for name in ("time", "p_WB")}
        found = judge_run(places, scene_of(about), {"p_WB": "0.1 %"})
        assert (found.agrees, found.unjudged) == (agrees, {})
