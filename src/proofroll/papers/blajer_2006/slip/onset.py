"""First slip of a ball: in the truth with its conditioning, and in every engine with its bracket."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.errors import InputError, ProofrollError, Refused
from proofroll.core.events import Event, EventKind, events_of
from proofroll.core.plugins import engine_names, parse_engine
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import read_columns
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.engine_questions import describe_each, resolve
from proofroll.running.idle_workers import Workers
from proofroll.running.process import status_of
from proofroll.running.runner import Runner
from proofroll.studies.cases import case_of

if TYPE_CHECKING:
    from proofroll.papers.blajer_2006.truth.onset import Onset

_EVERY = 0.01  # interval between samples [s]; engines that locate events do better than this
_SMALLEST = float(np.finfo(float).tiny)  # smaller times are round-off of zero
_LATER = 0.05  # first runs end this part later than the truth's slip; engines without a slip by then are run to the end


@dataclass(frozen=True)
class EngineOnset:
    """First slip in one engine.

    Attributes:
        engine: with the settings that were asked for.
        name: of the engine alone.
        settings: complete; empty if the engine could not be asked.
        status, message: end of its run.
        onset: the first slip with its bracket, or None.
        difference: from the truth's first slip [s]; None unless both slip.
        verdict: ``agree``, ``disagree``, ``ill-posed``, ``refused`` or ``failed``.
    """

    engine: str
    name: str
    settings: Mapping[str, Any]
    status: Status
    message: str
    onset: Event | None
    difference: float | None
    verdict: str


@dataclass(frozen=True)
class OnsetStudy:
    """First slips of the truth, with its conditioning, and of every engine in a scene with these parameters."""

    scene: str
    parameters: Mapping[str, Any]
    until: float
    truth: Onset
    engines: list[EngineOnset]


def default_engines(workers: Workers | None = None) -> list[str]:
    """Engines with each formulation that provides bounded friction, and names of engines that fail to start."""
    specs: list[str] = []
    for name, told in describe_each(engine_names(), workers).items():
        if isinstance(told, ProofrollError):
            specs.append(name)  # its row gives the reason
            continue
        provided = told.provides.items()
        slips = MechanismCapability.CONTACT_FRICTION
        specs += [f"{name}[formulation={key}]" for key, texts in provided if slips in texts]
    return specs


def onset_study(
    scene: str,
    parameters: dict[str, Any],
    runner: Runner,
    *,
    engines: Sequence[str] = (),
    until: float = 4.0,
    uncertainty: float = 1e-3,
    progress: Callable[[Case, Result], None] | None = None,
) -> OnsetStudy:
    """First slips of the truth and of the engines up to ``until`` [s], compared.

    Args:
        scene: name of the scene.
        parameters: its parameters; friction must be bounded.
        runner: runs the cases.
        engines: engines with settings; all that can slip if empty.
        until: last time to look at [s].
        uncertainty: relative uncertainty of μ and f for which the verdicts hold [1].
        progress: called with each finished case.

    Raises:
        InputError: the scene is not one ball that begins to roll in an upright cylinder, its friction is
            unbounded, or a name is unknown.
    """
    from proofroll.papers.blajer_2006.truth.onset import onset

    loaded = load_scene(scene, **parameters)
    try:
        body = rolling_ball(loaded)
    except Refused:
        advice = "a first slip needs one ball that begins to roll in an upright cylinder; name such a scene"
        raise InputError("scene", scene, advice) from None
    if math.isinf(body.contact.mu_static):
        raise InputError("mu_static", "inf", "without bounded friction the ball never slips; give --set mu_static=…")
    with ThreadPoolExecutor(1) as pool:  # engines start while the truth is worked out
        able = None if engines else pool.submit(default_engines, runner.workers)
        truth = onset(body, until, uncertainty)
        names = list(engines) if able is None else able.result()
    specs = [parse_engine(name) for name in names]
    facts = resolve([(spec.name, spec.options) for spec in specs], runner.workers)
    for facts_of_engine in facts:
        if isinstance(facts_of_engine, InputError):
            raise facts_of_engine
    asked = [facts_of_engine for facts_of_engine in facts if isinstance(facts_of_engine, EngineFacts)]

    def run(engines: Sequence[EngineFacts], end: float) -> list[tuple[Result, Event | None]]:
        cases = [case_of(scene, loaded, parameters, facts_of_engine, end, _EVERY) for facts_of_engine in engines]
        results = runner.run(cases, progress)
        return [(results[case.key], _first_slip(runner, case, results[case.key])) for case in cases]

    # The motion after the first slip decides nothing and costs most; only engines without a slip by then run to the
    # end.
    soon = _soon(truth, until)
    answers = run(asked, soon)
    late = [index for index, (result, slip) in enumerate(answers) if slip is None and result.status == Status.DONE]
    if late and soon < until:
        for index, answer in zip(late, run([asked[index] for index in late], until), strict=True):
            answers[index] = answer
    rows, answered = [], iter(answers)
    for name, spec, facts_of_engine in zip(names, specs, facts, strict=True):
        if not isinstance(facts_of_engine, EngineFacts):
            status = status_of(facts_of_engine)
            rows.append(
                EngineOnset(
                    engine=name,
                    name=spec.name,
                    settings={},
                    status=status,
                    message=str(facts_of_engine),
                    onset=None,
                    difference=None,
                    verdict="failed",
                )
            )
            continue
        result, slip = next(answered)
        apart = None if slip is None or truth.time is None else slip.time - truth.time
        ended = (result.status, result.message, slip, apart, onset_verdict(truth, result, slip))
        rows.append(EngineOnset(name, spec.name, facts_of_engine.settings, *ended))
    return OnsetStudy(scene=loaded.name, parameters=loaded.parameters, until=until, truth=truth, engines=rows)


def _soon(truth: Onset, until: float) -> float:
    """Time shortly after the truth's first slip, a whole number of samples [s]; ``until`` without a slip."""
    if truth.time is None:
        return until
    latest = max(truth.time, truth.latest or 0.0)
    return min(until, _EVERY * (math.ceil(latest * (1 + _LATER) / _EVERY) + 1))


def _first_slip(runner: Runner, case: Case, result: Result) -> Event | None:
    if result.trajectory is None:
        return None
    events = events_of(read_columns(runner.store.trajectory(case)))
    return next((event for event in events if event.kind == EventKind.SLIP), None)


def onset_verdict(truth: Onset, result: Result, slip: Event | None) -> str:
    """Verdict on an engine's first slip: its bracket must overlap the truth's times for the uncertain μ and f."""
    if result.status == Status.REFUSED:
        return "refused"
    if result.status != Status.DONE:
        return "failed"
    if truth.verdict == "ill-posed":
        return "ill-posed"
    if truth.time is None or slip is None:
        return "agree" if truth.time is None and slip is None else "disagree"
    times = [time for time in (truth.time, truth.earliest, truth.latest) if time is not None]
    return "agree" if slip.time_low <= max(times) and slip.time_high >= min(times) else "disagree"


def summary(study: OnsetStudy) -> str:
    """Sentences on the truth's first slip and its conditioning."""
    truth = study.truth
    if truth.time is None:
        return f"In the truth the ball does not slip within {study.until:g} s."
    text = "In the truth the ball slips from the start. "
    if truth.time > 0:
        text = f"In the truth the ball first slips at {truth.time:.9g} s; "
        text += f"d ln t / d ln mu = {_number(truth.by_mu)}, d ln t / d ln f = {_number(truth.by_f)}. "
    edges = [f"{edge:.6g}" for edge in (truth.edge_below, truth.edge_above) if edge is not None]
    if edges:
        text += f"The time jumps at mu = {' and '.join(edges)}, the nearest {100 * truth.distance:.3g} % away; "
    text += (
        f"{'for' if edges else 'For'} mu and f known to {100 * truth.uncertainty:g} % the question is {truth.verdict}."
    )
    return text


def first_slip_texts(slip: Event | None) -> tuple[str, str]:
    """Texts for a person: time of the first slip, and its bracket."""
    if slip is None:
        return "no slip", ""
    between = f"{slip.time_low:.9g} … {slip.time_high:.9g}"
    if slip.time > 0:
        return f"{slip.time:.9g}", between
    return "from the start", between if slip.time_high > _SMALLEST else ""


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.4g}"
