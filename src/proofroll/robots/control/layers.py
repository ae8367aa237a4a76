"""Layers of a record of a robot under a controller, each computed from those before it, without a simulation."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proofroll.core.number_format import counted, error
from proofroll.elements.mechanism import Mechanism
from proofroll.robots.control.air_fit import AirFit, StandingFit, acceleration_fit, standing_fit
from proofroll.robots.control.air_several import (
    commanded_layer,
    noise_beside,
    noise_of_states,
    noisy_layer,
    white_noise,
)
from proofroll.robots.control.bookkeeping.air import HeldRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import (
    IMPLICIT,
    LAYERS,
    SEARCH_TIME,
    Mistake,
    SearchTime,
    mistakes,
    offsets_told,
)
from proofroll.robots.control.bookkeeping.search import (
    LayerTrials,
    MistakeExplanation,
    another_pose,
    best_size,
    bounded,
    changed_columns,
    explanations,
    largest,
    may_close,
    mistakes_together,
)
from proofroll.robots.control.columns import action_mistakes
from proofroll.robots.control.differences import (
    DIFFERENCES,
    ROUND_OFF,
    SAME_TIME,
    LayerDifferences,
    at_instants,
    due_rows,
    efforts_of,
    held_rows,
    instant_rows,
    passed_instants,
    rows_are_steps,
    servo_rows,
    sources,
    targets_of,
)
from proofroll.robots.control.fits import ServoRows, observation_causes, ramps, servo_causes, target_causes
from proofroll.robots.control.motion import motion_layer
from proofroll.robots.control.record import FITTED, OBSERVED, ControlRecord, Layer, LayerCause
from proofroll.robots.model import Array

# Remark on a scheme that has the damping of joints at the velocity after a step.
_DAMPED = "damping of joints acts at the velocity after the step, or they have an armature of h times it more"
# Number of random roundings of a record that give the bar of a layer, and the factor on their largest change.
_ROUNDINGS, _SAFETY = 6, 3.0
# A cause counts if it leaves less than this part of a residual, or no more than the bar.
_HELPS = 0.1
_FIRST = 12  # instants of a long record at which mistakes are tried before all of it
_SIZE = re.compile(r"(?<=is )\S+( ± \S+)?(?= of the right one)")  # size of a cause, which two fits find apart
_INSTANTS = 4  # least number of rows from which a pose is fitted beside another mistake


def record_layers(
    record: ControlRecord,
    law: ControlLaw,
    mechanism: Mechanism,
    *,
    grounded: bool,
    names: Collection[str] = DIFFERENCES,
    stepwise: bool = False,
    in_air: InAir | None = None,
    time: SearchTime | None = None,
) -> list[Layer]:
    """All layers of a record, with causes at those that do not hold.

    Args:
        record: of a run under the law.
        law: the law as it should be.
        mechanism: the robot.
        grounded: True if something else than servos and gravity acts on the robot.
        names: of the layers before that of accelerations.
        stepwise: True if the program has no steps between the rows.
        in_air: robot against which accelerations are held; by default the mechanism.
        time: of the searches for mistakes; by default without an end.
    """
    evidence = _Evidence(record, law, mechanism, in_air or InAir(HeldRobot.of(mechanism)))
    layers: list[Layer] = []
    time = time or SearchTime()
    judgements = evidence.in_air.layers
    for name in names:
        if name in judgements:
            layer, record = judgements[name]
            evidence = dataclasses.replace(evidence, record=record)
        else:
            layer = _layer(name, evidence, {item.name for item in layers if item.residual is None}, time)
            if not layer.holds and (name == "observation" or (name == "action" and not layer.causes)):
                layer, evidence = _of_columns(layer, evidence)
            if layer.holds or not time.over:
                judgements[name] = layer, evidence.record
        layers.append(layer)
    record = evidence.record
    if grounded:
        layers.append(Layer("acceleration", reason="the robot touches the ground, whose forces no record has"))
        return layers
    lacking = {layer.name for layer in layers if layer.residual is None}
    layers.append(_in_air(evidence, layers, time, stepwise=stepwise))
    if all(layer.holds and not layer.noise for layer in layers) and lacking & {"target", "effort"}:
        layers.append(motion_layer(record, law, mechanism, lambda part: _fit_by_law(part, evidence), time))
    return layers


@dataclass(frozen=True)
class InAir:
    """Robots that the accelerations of a record are held against.

    Attributes:
        held: the robot.
        imported: robots that are tried where it differs.
        reported: the record with the frame of its base, if that is not the one of the other layers.
        stepped: the robot with the frame of its file, where a program may step that and report another; else None.
        ranges: joint -> its limits [rad or m].
        assumed: clause on rows that are steps if the program has its usual ones; empty: they are not, or it is known.
        fits: of records to robots that were compared before, by their identities.
        layers: name -> a layer that was judged before, and the record with its columns corrected.
    """

    held: HeldRobot
    imported: Callable[[], Iterable[HeldRobot]] = tuple
    reported: ControlRecord | None = None
    stepped: HeldRobot | None = None
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    assumed: str = ""
    fits: dict[tuple[int, int], tuple[ControlRecord, StandingFit]] = field(default_factory=dict)
    layers: dict[str, tuple[Layer, ControlRecord]] = field(default_factory=dict)

    def fit(self, record: ControlRecord, law: ControlLaw, robot: HeldRobot, efforts: Array) -> StandingFit:
        """Fit of a record to one of the robots, computed once: it hangs on no search."""
        key = id(record), id(robot)
        if key not in self.fits:
            fit = standing_fit(record, law, robot, efforts, held_rows(record, law), self.ranges)
            self.fits[key] = record, fit
        return self.fits[key][1]


@dataclass(frozen=True)
class _Evidence:
    record: ControlRecord
    law: ControlLaw
    mechanism: Mechanism
    in_air: InAir
    right: LayerDifferences | None = None

    def difference(
        self, name: str, law: ControlLaw | None = None, record: ControlRecord | None = None
    ) -> LayerDifferences | str:
        """Differences of a layer, or the reason why there are none."""
        return DIFFERENCES[name](record or self.record, law or self.law)

    def left(self, name: str, law: ControlLaw) -> Array:
        """Differences under a law in parts of the sizes of their columns, or of those of ``right``; NaN: none are."""
        compared = self.difference(name, law)
        if isinstance(compared, str):
            return np.array(np.nan)
        sized = self.right if self.right and self.right.columns == compared.columns else compared
        return np.ravel(compared.difference / sized.sizes)


def _layer(name: str, evidence: _Evidence, skipped: Collection[str], time: SearchTime) -> Layer:
    """A layer, with the mistakes that explain it if it does not hold; ``skipped``: those not looked at before it."""
    compared = (name != "effort" and passed_instants(evidence.record, evidence.law)) or evidence.difference(name)
    if not isinstance(compared, str) and not len(compared.time):
        compared = "no row that counts lies at an instant of the controller"
    if isinstance(compared, str):
        return Layer(name, reason=compared)
    bars = _bars(name, evidence, compared)
    parts = np.abs(compared.difference) / bars
    row, column = np.unravel_index(int(np.argmax(parts)), parts.shape)
    layer = Layer(
        name=name,
        residual=abs(float(compared.difference[row, column])),
        bar=float(bars[column]),
        column=compared.columns[column],
        time=float(compared.time[row]),
    )
    noise = None if layer.holds else noise_of_states(evidence.record)
    if noise is not None:
        changes = len(instant_rows(evidence.record, evidence.law)) - 1  # the others should change but for noise
        noisy = _bars(name, dataclasses.replace(evidence, record=noise.record), compared)
        seen = compared.difference[: changes if name == "instants" else None]
        if np.all(np.abs(seen) <= noisy + noise_beside(seen)):
            reason = f"off by {error(float(np.abs(compared.difference).max()))}, which {noise.words} may make"
            return Layer(name, reason=reason, undecided=True, noise=noise.part)
    causes = {} if layer.holds else _explained(name, compared, bars, skipped, evidence, time)
    return dataclasses.replace(layer, **causes)


def _in_air(evidence: _Evidence, layers: Sequence[Layer], time: SearchTime, *, stepwise: bool) -> Layer:
    """Layer of accelerations, from recorded efforts."""
    record, law, assumed = evidence.in_air.reported or evidence.record, evidence.law, evidence.in_air.assumed
    efforts = record.stacked("effort", law.joints)
    if efforts is None:
        return commanded_layer(record, law, evidence.in_air.held)
    fit, off_stops, remark = evidence.in_air.fit(record, law, evidence.in_air.held, efforts)
    if evidence.in_air.stepped is not None and not isinstance(fit, str) and fit.off > fit.bar:
        rival = evidence.in_air.fit(evidence.record, law, evidence.in_air.stepped, efforts)
        if not isinstance(rival.fit, str) and rival.fit.left < fit.left:
            fit, off_stops, remark = rival
    if isinstance(fit, str):
        return Layer("acceleration", reason=f"{remark}; {fit}" if remark else fit)
    off = f"the forces are off by {error(fit.off)} of the largest"
    if (hidden := _hidden(record, law, evidence.in_air.held, fit, off)) is not None:
        return hidden
    if fit.off > fit.bar and all(cause.id == FITTED for cause in fit.causes):
        fit, ended = _of_another_robot(record, evidence, efforts, fit, off_stops, time)
        remark = "; ".join(part for part in (remark, ended) if part)
    fit = dataclasses.replace(fit, between=fit.between and not (stepwise or rows_are_steps(record, law)))
    if fit.bar >= 1 and not fit.causes:
        return Layer("acceleration", reason="the rounding of the record is larger than the forces")
    if fit.between:
        advice = f"steps between the rows may explain it: {assumed or 'log every step to decide'}"
        reason = "; ".join(filter(None, (f"{off}, and no cause is known", advice, remark)))
        return Layer("acceleration", reason=reason, undecided=True)
    implicit = IMPLICIT if law.kp.any() else IMPLICIT.replace("kd", "damping")
    holds = fit.off <= fit.bar and not fit.causes
    if assumed and not holds and all(cause.after > fit.bar for cause in fit.causes):
        remark = "; ".join(filter(None, (remark, assumed)))
    return Layer(
        name="acceleration",
        residual=fit.off,
        bar=fit.bar if holds else min(fit.bar, 0.99 * fit.off),
        column="the forces",
        reason="; ".join(
            part for part in (implicit if fit.imitated else "", _DAMPED if fit.damped else "", remark) if part
        ),
        causes=fit.causes,
        tried=fit.tried if all(layer.holds for layer in layers) else 0,
    )


def _hidden(record: ControlRecord, law: ControlLaw, held: HeldRobot, fit: AirFit, off: str) -> Layer | None:
    """Layer of accelerations that noise, soft friction or the digits of the record hide; None: nothing does."""
    floats, undecided = "q_WB.w" in record.columns, partial(Layer, "acceleration", undecided=True)
    if fit.off <= fit.bar and not fit.hidden:
        return None
    if (white := white_noise(record, efforts=not floats)) is not None:
        advice = f"white noise of up to {error(100 * white.part, 1)} % of a range may hide one"
        hidden = undecided(reason=f"{off}, and no cause is known; {advice}", noise=white.part)
        return hidden if floats else noisy_layer(record, law, held, off) or hidden
    if (noise := noise_of_states(record)) is not None:
        return undecided(reason=f"{off}; {noise.words} may hide a cause", noise=noise.part)
    return undecided(reason=f"{off}; {fit.hidden}", noise=fit.off) if fit.hidden and fit.bar < 1 else None


def _of_another_robot(
    record: ControlRecord, evidence: _Evidence, efforts: Array, fit: AirFit, usable: NDArray[np.bool_], time: SearchTime
) -> tuple[AirFit, str]:
    """Fit with the robot that an importer makes of the file and that explains the record by the fewest causes.

    It is the fit itself where there is none. The second item is a remark on a search that ended.
    """
    law, best, ended = evidence.law, (math.inf, math.inf, math.inf), ""
    chosen = fit
    for robot in evidence.in_air.imported():
        if (len(robot.causes), 0) > best[:2]:
            break  # what follows has as many causes or more
        if time.over:
            ended = f"the search for robots as importers read it ended after {SEARCH_TIME:.0f} s of processor time"
            break
        trial = acceleration_fit(record, law, robot, efforts, held_rows(record, law), usable, together=False)
        if isinstance(trial, str) or trial.between or any(cause.id == FITTED for cause in trial.causes):
            continue
        if trial.off > trial.bar and not trial.causes:
            continue
        left = trial.left
        if left > max(trial.bar, _HELPS * fit.off):  # a robot far from this one may be helped by anything
            continue
        further = bool(trial.causes)  # several of them are alternatives
        if (rank := (len(robot.causes) + further, further, left)) < best:
            proof = f"forces off by {error(fit.off)} of their size, by {error(left, 1)} with that"
            cause = LayerCause(robot.causes[0], f"{robot.words} ({proof})", None, left)
            best, chosen = rank, dataclasses.replace(fit, causes=(cause, *trial.causes), between=False)
    return chosen, ended if chosen is fit else ""


def _fit_by_law(record: ControlRecord, evidence: _Evidence) -> AirFit | str:
    """Fit of accelerations to efforts that the law gives for the states of a record."""
    efforts = efforts_of(record, evidence.law)
    if isinstance(efforts, str) or not np.isfinite(efforts).all():
        return efforts if isinstance(efforts, str) else "the record begins between two instants"
    return acceleration_fit(record, evidence.law, evidence.in_air.held, efforts, held_rows(record, evidence.law))


def _bars(name: str, evidence: _Evidence, compared: LayerDifferences) -> Array:
    """Difference of each column that the rounding of the record explains."""
    generator = np.random.default_rng(0)
    changes = [np.zeros(len(compared.columns))]
    for _ in range(_ROUNDINGS):
        moved = evidence.difference(name, record=evidence.record.rounded(generator))
        if isinstance(moved, LayerDifferences) and moved.difference.shape == compared.difference.shape:
            changes.append(np.abs(moved.difference - compared.difference).max(axis=0))
    return np.asarray(_SAFETY * np.max(changes, axis=0) + ROUND_OFF * compared.sizes)


def _explained(
    name: str, compared: LayerDifferences, bars: Array, skipped: Collection[str], evidence: _Evidence, time: SearchTime
) -> dict[str, Any]:
    """Mistakes that leave a small part of a layer's residual, the best first, and how many were tried.

    Mistakes of the layers before it count where the record does not show these; ``skipped``: their names.
    """
    shown = [*(item for item in list(LAYERS)[: list(LAYERS).index(name)] if item in skipped), name]
    evidence, right = dataclasses.replace(evidence, right=compared), compared.difference / compared.sizes
    distance, rounding = largest(right), float((bars / compared.sizes).max())
    most = max(_HELPS * distance, min(rounding, 0.5 * distance))
    wrong, under = np.abs(right).max(axis=0) > most, partial(evidence.left, name)

    def explanation(mistake: Mistake) -> MistakeExplanation | None:
        if mistake.sized and not changed_columns([mistake], evidence.law, under, right)[mistake.words][wrong].all():
            return None
        left, size = best_size(mistake, evidence.law, under)
        if left > most:
            return None
        item, bound = MistakeExplanation(mistake, size, left), max(2 * left, rounding)
        return bounded(item, lambda size: largest(under(mistake.changed(evidence.law, size))), bound)

    every, previous = mistakes(evidence.law), list(LAYERS)[list(LAYERS).index(name) - 1]
    candidates = [item for item in every if item.layer in shown or (item.later and item.layer == previous)]
    several, tried = explanations(candidates, explanation, time)
    ranked = [(item.rank, item.cause) for item in several]
    if "target" in shown and (offset := _offset(evidence, evidence.law)) is not None:
        left = _norm(evidence, name, offset.changed(evidence.law, 1.0))
        cause = MistakeExplanation(offset, 1.0, left).cause
        ranked += [(2 * left, cause)] if left <= _HELPS * distance else []  # its numbers are many: fewer go before
    if all(cause.after > rounding for _, cause in ranked):
        fits = _fitted_causes(name, compared, evidence, most)
        ranked += [((1 + cause.numbers) * cause.after, cause) for cause in fits]  # a number takes away as much again
    by_words: dict[str, LayerCause] = {}
    for _, cause in sorted(ranked, key=lambda item: item[0]):
        words = _SIZE.sub("", cause.sentence)
        if "±" in cause.sentence or words not in by_words:  # a sign is a size of -1, too
            by_words[words] = cause
    causes = [*by_words.values()]
    if name == "instants":
        closing = [cause for cause in causes if cause.after <= rounding]
        causes = closing or [*_missed(evidence, candidates)] or causes
    elif all(cause.after > rounding for cause in causes):
        together = _together(name, candidates, evidence, bars, time)
        causes = causes if together is None else [together]
    closing = [cause for cause in causes if cause.after <= rounding]
    causes = closing or [cause.with_rest(cause.after / distance) for cause in causes]
    return {"causes": tuple(causes), "tried": tried, "known": len(candidates)}


def _together(
    name: str, candidates: Sequence[Mistake], evidence: _Evidence, bars: Array, time: SearchTime
) -> LayerCause | None:
    """Cause that names mistakes which close a layer together; its first instants are looked at before the whole."""
    law, trials, rows = evidence.law, _trials(name, evidence, bars), instant_rows(evidence.record, evidence.law)
    if len(rows) > _FIRST:
        begun = dataclasses.replace(evidence, record=evidence.record.part(np.arange(rows[_FIRST])))
        first = _trials(name, begun, bars)
        same = np.array_equal(first.parts(law) > 1, trials.parts(law) > 1)
        if same and not may_close(candidates, law, first, time):
            return None
    return mistakes_together(candidates, law, trials, time)


def _trials(name: str, evidence: _Evidence, bars: Array) -> LayerTrials:
    """Trials of laws at a layer whose columns have these bars."""

    def parts(law: ControlLaw) -> Array:
        compared = evidence.difference(name, law)
        if isinstance(compared, str) or compared.difference.shape[1] != len(bars) or not len(compared.difference):
            return np.full(len(bars), np.nan)
        return np.asarray(np.abs(compared.difference).max(axis=0) / bars)

    def fitting(law: ControlLaw) -> Iterator[Mistake]:
        offset = _offset(evidence, law, _INSTANTS) if name == "target" else None
        yield from [] if offset is None else [offset]

    return LayerTrials(parts, partial(evidence.left, name), fitting)


def _fitted_causes(name: str, compared: LayerDifferences, evidence: _Evidence, most: float) -> Iterator[LayerCause]:
    """Mistakes of some numbers that explain a layer."""
    record, law = evidence.record, evidence.law
    if name == "observation":
        yield from observation_causes(compared.columns, compared.recorded, compared.difference, compared.sizes, most)
    elif name == "effort":
        efforts, servos = record.stacked("effort", law.joints), servo_rows(record, law)
        if efforts is None or isinstance(servos, str):
            return
        target, q, v, known = servos
        rows = ServoRows(target=target[known], q=q[known], v=v[known], effort=efforts[known])
        yield from servo_causes(rows, law, most)
    elif name == "target" and law.policy is not None:
        part = at_instants(record, law)
        targets, actions = (part.stacked(kind, law.joints) for kind in ("target", "action"))
        if targets is None or actions is None:
            return
        yield from _ramped(evidence, most)
        source, places = sources(part, law), part.stacked("q", law.joints)
        later = np.flatnonzero(source >= 0)
        seen = None if places is None else places[later]
        yield from target_causes(targets[later], actions[source[later]], seen, law, most)


def _ramped(evidence: _Evidence, most: float) -> Iterator[LayerCause]:
    """Targets of all rows that are reached along a ramp from one instant to the next."""
    record, law = evidence.record, evidence.law
    instants, recorded = instant_rows(record, law), record.stacked("target", law.joints)
    goals = targets_of(at_instants(record, law), law)
    if recorded is None or isinstance(goals, str):
        return
    place = np.searchsorted(instants, np.arange(len(recorded)), side="right") - 1
    for targets in ramps(goals[np.maximum(place, 0)]):
        rows_told = np.isfinite(targets).all(axis=1)
        residual = float((np.abs(targets - recorded)[rows_told] / np.abs(recorded).max(axis=0)).max())
        if residual <= most:
            yield LayerCause("ramped", "targets go along a straight line from one instant to the next", None, residual)


def _of_columns(layer: Layer, evidence: _Evidence) -> tuple[Layer, _Evidence]:
    """A layer with the mistake of the columns of actions that explains it, and evidence without that mistake.

    At an observation, which has the last action, it must explain the actions as well.
    """
    if layer.name == "observation" and not layer.column.startswith(f"{OBSERVED}.last."):
        return layer, evidence
    instants = instant_rows(evidence.record, evidence.law)
    column_mistakes = [*action_mistakes(evidence.law, instants)]
    trials = []
    for mistake in column_mistakes:
        corrected = dataclasses.replace(evidence, record=mistake.changed(evidence.record))
        left = _norm(corrected, layer.name, evidence.law)
        parts = {name: _norm(evidence, name, evidence.law) for name in {layer.name, "action"}}
        if all(
            np.isfinite(part) and _norm(corrected, name, evidence.law) <= _HELPS * part for name, part in parts.items()
        ):
            trials.append((left, LayerCause(mistake.id, mistake.words, None, left), corrected))
    tried = dataclasses.replace(
        layer, tried=layer.tried + len(column_mistakes), known=layer.known + len(column_mistakes)
    )
    if not trials:
        return tried, evidence
    _, cause, evidence = min(trials, key=lambda item: item[0])
    return dataclasses.replace(tried, causes=(cause,)), evidence


def _missed(evidence: _Evidence, candidates: Iterable[Mistake]) -> Iterator[LayerCause]:
    """Instants at which the action before acts again, where all others have one, at the rate that misses fewest."""
    record, times, trials = evidence.record, evidence.record.time, list[tuple[int, LayerCause]]()
    rates = [
        (item.id, f"{item.words}; and ", item.changed(evidence.law, 1.0)) for item in candidates if item.id == "rate"
    ]
    for name, words, law in [("", "", evidence.law), *rates]:
        changes, due = instant_rows(record, law), due_rows(record, law)
        others = times[changes] * law.rate
        missed = [row for row in due.tolist() if np.abs(times[changes] - times[row]).min() > 0.5 / law.rate]
        if missed and np.abs(others - np.round(others)).max() <= SAME_TIME:
            when = f"at {counted(len(missed), 'instants')}, first at {times[missed[0]]:.4g} s"
            cause = LayerCause(
                " + ".join(filter(None, [name, "repeated"])), f"{words}{when}, the action before acts again", None, 0.0
            )
            trials.append((len(missed) + bool(name), cause))
    yield from (cause for _, cause in sorted(trials, key=lambda item: item[0])[:1])


def _offset(evidence: _Evidence, law: ControlLaw, fewest: int = 1) -> Mistake | None:
    """Another default pose, as the mean difference of each joint's target; None without as many instants."""
    compared = evidence.difference("target", law)
    fixed = law.policy is not None or all(isinstance(item, float) for item in law.targets)
    if isinstance(compared, str) or len(compared.difference) < fewest or not fixed:
        return None
    offsets = compared.difference.mean(axis=0)
    return another_pose(offsets_told(law.joints, offsets), law.signs * offsets)


def _norm(evidence: _Evidence, name: str, law: ControlLaw) -> float:
    """Largest difference of a layer in parts of the size of its column."""
    return largest(evidence.left(name, law))
