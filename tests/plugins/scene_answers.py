"""Statements about a scene that no frame and no name changes: end of its truth, events, causes and verdicts."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from proofroll.core.dataset import ended_early
from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene
from proofroll.core.errors import Diverged, InputError, Refused
from proofroll.core.first_steps import certificate
from proofroll.core.plugins import load_engine, parse_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.core.time_grid import time_grid
from proofroll.core.truth import truth
from proofroll.core.verdict import Allowance, Judgement, Verdict, judge_curve
from proofroll.running.recording import record
from proofroll.running.simulation import build
from proofroll.studies.comparison.default_comparison import bounds
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import Reference

# Vectors are judged by their components, so that a turn may change an error, or its allowance, by the root of 3 each.
NEAR = 3.0
# Part of a row of bounces, before they end, in which one more or less may count: speeds are cut at a part of the first.
_LAST = 0.01


@dataclass
class Answers:
    """Statements about a scene.

    Attributes:
        refused: words of a refusal of the truth.
        ended: time [s] and words of an early end of the truth.
        ill_posed: True if its question is ill-posed.
        events: kind, name, time and width of the bracket [s].
        places: of the bodies' frames, shape (time, body, 3) [m], and their error bar [m].
        verdicts: run -> observable -> verdict, and the ratio of the error and the tolerance.
        causes: run -> identifiers of its proven causes.
        certificates: run -> words of a refusal or a difference.
    """

    refused: str = ""
    ended: tuple[float, str] | None = None
    ill_posed: bool = False
    events: list[tuple[str, str, float, float]] = field(default_factory=list)
    bodies: list[str] = field(default_factory=list)
    places: tuple[Any, float] = (np.zeros((0, 0, 3)), 0.0)
    verdicts: dict[str, dict[str, tuple[str, float]]] = field(default_factory=dict)
    causes: dict[str, list[str]] = field(default_factory=dict)
    certificates: dict[str, str] = field(default_factory=dict)


def answers(scene: Scene, until: float, every: float, runs: Mapping[str, Callable[[Scene], Scene] | None]) -> Answers:
    """Statements about a scene, and about engines that run it.

    Args:
        scene: the scene.
        until: last time [s].
        every: sampling interval [s].
        runs: engine with its settings -> the scene that it takes instead of this; None: this one.
    """
    found = Answers()
    times = np.asarray(time_grid(until, every))
    try:
        true = truth(scene, times)
    except (Refused, Diverged, InputError) as refusal:
        found.refused = str(refusal)
        return found
    end = ended_early(true)
    found.ended = end and (float(end[0]), end[1])
    reference = Reference.of(scene, true)
    found.ill_posed = bool(reference.ill_posed)
    found.events = [
        (event.kind, event.name, event.time, event.time_high - event.time_low) for event in reference.events
    ]
    places = reference.dataset["p_WB"]
    found.bodies = list(map(str, places["body"].to_numpy())) if "body" in places.dims else []
    found.places = places.to_numpy(), float(places.attrs.get("error_bar", 0.0))
    for name, changed in runs.items():
        _run(found, name, scene if changed is None else changed(scene), reference, times)
    return found


def _run(found: Answers, name: str, taken: Scene, reference: Reference, times: Any) -> None:
    """Adds the statements about a run."""
    spec = parse_engine(name.partition(" ")[0])
    try:
        kind = load_engine(spec.name)
        settings = resolve_settings(kind, spec.options, taken.requires)
        engine = build(taken, name.partition(" ")[0])
        lines = certificate(kind, engine, taken, settings)  # a changed scene is a fault that its engine does not tell
        recording = record(engine, taken, times)
    except (Refused, Diverged, InputError) as refusal:
        found.certificates[name] = str(refusal)
        return
    broken = [line.quantity for line in lines if not line.holds]
    found.certificates[name] = ", ".join(sorted(broken)) + (" failed" if recording.failure else "")
    judgements = _judged(reference, recording.dataset, float(times[1] - times[0]))
    found.verdicts[name] = {item.observable: (str(item.verdict), item.error / item.tolerance) for item in judgements}
    if broken or any(item.verdict is Verdict.DIFFERS for item in judgements):
        step = getattr(settings, "dt", None)
        causes = diagnose_scene(
            reference.scene, [line.as_dict() for line in lines], recording.dataset, reference.dataset, step, judgements
        )
        found.causes[name] = [item.cause.id for item in causes]


def _judged(reference: Reference, dataset: xr.Dataset, every: float) -> list[Judgement]:
    """Verdicts of a first look on a run, as a comparison gives them."""
    shorter, cut = reference.common_span({1.0: dataset})
    curves = run_values.observables_of(shorter, cut[1.0])
    given, found = bounds(reference.scene, every), []
    for name, values in curves.items():
        tolerance = given.get(name) or run_values.always_judged(shorter, curves).get(name)
        if tolerance is None:
            continue
        scale = shorter.sizes.get(name, 1.0)
        allowance = Allowance(name, shorter.scene.observables[name].unit, tolerance.absolute(scale), scale)
        run = run_values.run_curve(shorter, name, values, cut[1.0])
        found.append(judge_curve(allowance, run, shorter.true(name, values)))
    return found


def differences(one: Answers, other: Answers, names: Mapping[str, str], moved: Callable[[Any], Any]) -> list[str]:
    """Sentences about all that is stated otherwise about the same scene.

    Args:
        one: of the scene.
        other: of the scene with other axes, origin, names and order.
        names: name in the scene -> name in the other.
        moved: places of the scene [m] -> those of the other.
    """
    told = [
        f"{what}: {a} became {b}"
        for what, a, b in (
            ("refusal", _words(one.refused, names), _words(other.refused, names)),
            ("ill-posed", one.ill_posed, other.ill_posed),
            ("reason of the end", _words((one.ended or (0, ""))[1], names), _words((other.ended or (0, ""))[1], names)),
        )
        if a != b
    ]
    told += _events_apart(one, other, names)
    if one.ended and other.ended and abs(one.ended[0] - other.ended[0]) > _CLOSE * one.ended[0]:
        told.append(f"end: {one.ended[0]!r} became {other.ended[0]!r} s")
    if one.places[0].size:
        told += _places_apart(one, other, names, moved)
    for run in one.certificates.keys() | other.certificates.keys():
        a, b = (_words(item.certificates.get(run, ""), names) for item in (one, other))
        if a != b:
            told.append(f"certificate of {run}: {a} became {b}")
    for run in one.verdicts.keys() & other.verdicts.keys():
        told += _verdicts_apart(run, one.verdicts[run], other.verdicts[run], names)
        if any(1 / NEAR < ratio < NEAR for item in (one, other) for _, ratio in item.verdicts[run].values()):
            continue  # what is nearly right in one may be right in the other, where nothing is asked for its cause
        a, b = ([_words(cause, names) for cause in item.causes.get(run, [])] for item in (one, other))
        if a != b:
            told.append(f"causes of {run}: {a} became {b}")
    return told


_CLOSE = 1e-6  # relative: of ends of a truth, whose cause may be found at the next step of a route


def _places_apart(one: Answers, other: Answers, names: Mapping[str, str], moved: Callable[[Any], Any]) -> list[str]:
    """Places that are not the same within both error bars, and bars that differ by orders."""
    (a, bar), (b, its) = one.places, other.places
    if one.bodies:
        b = b[:, [other.bodies.index(names.get(name, name)) for name in one.bodies]]
    count = min(len(a), len(b))
    apart = float(np.max(np.abs(moved(a[:count]) - b[:count]), initial=0.0))
    size = float(np.max(np.abs(b), initial=1.0))
    if apart > 3 * (bar + its) + 1e-13 * size:
        return [f"places are {apart:.2g} m apart, with bars of {bar:.2g} and {its:.2g} m"]
    low, high = sorted((max(bar, 1e-11 * size), max(its, 1e-11 * size)))
    return [f"bar: {bar:.2g} became {its:.2g} m"] if high > 100 * low else []


def _events_apart(one: Answers, other: Answers, names: Mapping[str, str]) -> list[str]:
    """Events of another kind, name or time; those at one time are compared without their order."""

    def listed(item: Answers, them: Mapping[str, str]) -> list[tuple[str, str, float, float]]:
        ends = {name: time for kind, name, time, _ in item.events if kind == "settle"}
        kept = [
            (kind, name, time, width)
            for kind, name, time, width in item.events
            if kind != "impact" or time < (1 - _LAST) * ends.get(name, np.inf)
        ]
        return sorted(((kind, _named(name, them), time, width) for kind, name, time, width in kept), key=_by)

    a, b = listed(one, names), listed(other, {})
    if [(kind, name) for kind, name, *_ in a] != [(kind, name) for kind, name, *_ in b]:
        return [f"events: {a} became {b}"]
    return [
        f"event {kind} {name}: {t!r} became {its!r} s"
        for (kind, name, t, width), (_, _, its, other_width) in zip(a, b, strict=True)
        if abs(t - its) > width + other_width + 1e-10
    ]


def _by(event: tuple[str, str, float, float]) -> tuple[float, str, str]:
    return round(event[2], 8), event[0], event[1]


def _verdicts_apart(
    run: str, one: Mapping[str, tuple[str, float]], other: Mapping[str, tuple[str, float]], names: Mapping[str, str]
) -> list[str]:
    told = []
    mapped = {_named(name, names): item for name, item in one.items()}
    for name in mapped.keys() | other.keys():
        if name not in mapped or name not in other:
            told.append(f"{run}: {name} is judged in one alone")
        elif mapped[name][0] != other[name][0] and _counts(mapped[name], other[name]):
            told.append(f"{run}: {name} {mapped[name]} became {other[name]}")
    return sorted(told)


def _counts(one: tuple[str, float], other: tuple[str, float]) -> bool:
    """True if two verdicts with their ratios of error and tolerance differ by more than components of vectors may.

    A force across a joint's axis is indeterminate, which leaves two components where an axis of the world lies along
    it and none elsewhere.
    """
    if Verdict.NOT_JUDGED in {one[0], other[0]}:
        return False
    return not any(1 / NEAR < ratio < NEAR for _, ratio in (one, other))


def _words(text: str, names: Mapping[str, str]) -> str:
    """A text without numbers and without the names in either scene."""
    for name in sorted({*names, *names.values()}, key=len, reverse=True):
        text = re.sub(rf"(?<![\w']){re.escape(name)}(?![\w])", "\0", text)
    text = text.replace("\0", "*")
    return re.sub(r"(?<![\w.])[-+]?\d[\d.]*(e[-+]?\d+)?", "#", text)


def _named(name: str, names: Mapping[str, str]) -> str:
    """A name of a part, of one of its corners, or of an observable of it, in the other scene."""
    return ".".join(names.get(part, part) for part in name.split("."))
