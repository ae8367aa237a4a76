"""Layers of a record of a robot under a controller, each computed from those before it, without a simulation."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from proofroll.core.number_format import counted, error
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.policy import Observation
from proofroll.robots.control.air_fit import AirFit, acceleration_fit
from proofroll.robots.control.bookkeeping.law import VECTORS, ControlLaw, RobotState
from proofroll.robots.control.bookkeeping.mistakes import (
    IMPLICIT,
    LAYERS,
    SEARCH_TIME,
    Mistake,
    SearchTime,
    mistakes,
    offsets_told,
)
from proofroll.robots.control.bookkeeping.search import MistakeExplanation, best_size, explanations, largest
from proofroll.robots.control.motion import motion_layer
from proofroll.robots.control.record import BASE, OBSERVED, ControlRecord, Layer, LayerCause
from proofroll.robots.model import Array

# Least residual that counts, in parts of the largest number of its column: round-off of a sum of some terms.
_ROUND_OFF = 1e-9
# Part of the largest forces up to which what is left without a cause is taken for the program's steps between the rows:
# fourth order in steps of 5 ms leaves a seventh of it, a thigh that is heavier by a fifth four times as much.
_STEPS = 1e-2
# Remark on what is taken for them.
BETWEEN = "no cause is known; taken for the program's own steps between the rows"
# Number of random roundings of a record that give the bar of a layer, and the factor on their largest change.
_ROUNDINGS, _SAFETY = 6, 3.0
# A cause counts if it leaves less than this part of a residual, or no more than the bar.
_HELPS = 0.1
_SAME_TIME = 1e-6  # part of the time between instants that is round-off


@dataclass(frozen=True)
class _Compared:
    """Differences of a layer with its columns: ``difference`` (times, columns), in their units, and their sizes."""

    columns: tuple[str, ...]
    time: Array
    difference: Array
    sizes: Array


def record_layers(record: ControlRecord, law: ControlLaw, mechanism: Mechanism, *, grounded: bool) -> list[Layer]:
    """All layers of a record, with causes at those that do not hold.

    Args:
        record: of a run under the law.
        law: the law as it should be.
        mechanism: the robot.
        grounded: True if something else than servos and gravity acts on the robot.
    """
    evidence = _Evidence(record, law, mechanism)
    layers: list[Layer] = []
    time = SearchTime(SEARCH_TIME)
    for name in _DIFFERENCES:
        layer = _layer(name, evidence)
        if not layer.holds:
            skipped = {item.name for item in layers if item.residual is None}
            layer = dataclasses.replace(layer, **_explained(layer, skipped, evidence, time))
        layers.append(layer)
    if grounded:
        layers.append(Layer("acceleration", reason="the robot touches the ground, whose forces no record has"))
        return layers
    lacking = {layer.name for layer in layers if layer.residual is None}
    layers.append(_in_air(evidence, layers))
    if all(layer.holds for layer in layers) and lacking & {"target", "effort"}:
        layers.append(motion_layer(record, law, mechanism, lambda part: _fit_by_law(part, evidence), time))
    return layers


@dataclass(frozen=True)
class _Evidence:
    record: ControlRecord
    law: ControlLaw
    mechanism: Mechanism

    def difference(
        self, name: str, law: ControlLaw | None = None, record: ControlRecord | None = None
    ) -> _Compared | str:
        """Differences of a layer, or the reason why there are none."""
        return _DIFFERENCES[name](record or self.record, law or self.law)

    def left(self, name: str, law: ControlLaw) -> Array:
        """Differences of a layer under a law in parts of the sizes of their columns; NaN where there are none."""
        compared = self.difference(name, law)
        return np.array(np.nan) if isinstance(compared, str) else (compared.difference / compared.sizes).ravel()


def _layer(name: str, evidence: _Evidence) -> Layer:
    compared = evidence.difference(name)
    if not isinstance(compared, str) and not len(compared.time):
        compared = "no row that counts lies at an instant of the controller"
    if isinstance(compared, str):
        return Layer(name, reason=compared)
    bars = _bars(name, evidence, compared)
    parts = np.abs(compared.difference) / bars
    row, column = np.unravel_index(int(np.argmax(parts)), parts.shape)
    return Layer(
        name=name,
        residual=abs(float(compared.difference[row, column])),
        bar=float(bars[column]),
        column=compared.columns[column],
        time=float(compared.time[row]),
    )


def _in_air(evidence: _Evidence, layers: Sequence[Layer]) -> Layer:
    """Layer of accelerations, from recorded efforts."""
    record, law = evidence.record, evidence.law
    efforts = record.stacked("effort", law.joints)
    if efforts is None:
        return Layer("acceleration", reason="the record has no columns effort.JOINT")
    fit = acceleration_fit(record, law, evidence.mechanism, efforts, held_rows(record, law))
    if isinstance(fit, str):
        return Layer("acceleration", reason=fit)
    if fit.between and fit.off > _STEPS:
        off = f"the forces are off by {error(fit.off)} of the largest, and no cause is known"
        return Layer("acceleration", reason=f"{off}; steps between the rows may explain it: log every step to decide")
    holds = (fit.off <= fit.bar and not fit.causes) or fit.between
    earlier = next((layer.name for layer in layers if not layer.holds), "")
    return Layer(
        name="acceleration",
        residual=fit.off,
        bar=max(fit.off, fit.bar) if holds else min(fit.bar, 0.99 * fit.off),
        column="the forces",
        reason=IMPLICIT if fit.imitated else BETWEEN if fit.between else "",
        causes=fit.causes,
        tried=0 if earlier else fit.tried,
    )


def _fit_by_law(record: ControlRecord, evidence: _Evidence) -> AirFit | str:
    """Fit of accelerations to efforts that the law gives for the states of a record."""
    efforts = _efforts(record, evidence.law)
    if isinstance(efforts, str) or not np.isfinite(efforts).all():
        return efforts if isinstance(efforts, str) else "the record begins between two instants"
    return acceleration_fit(record, evidence.law, evidence.mechanism, efforts, held_rows(record, evidence.law))


def _bars(name: str, evidence: _Evidence, compared: _Compared) -> Array:
    """Difference of each column that the rounding of the record explains."""
    generator = np.random.default_rng(0)
    changes = [np.zeros(len(compared.columns))]
    for _ in range(_ROUNDINGS):
        moved = evidence.difference(name, record=evidence.record.rounded(generator))
        if isinstance(moved, _Compared) and moved.difference.shape == compared.difference.shape:
            changes.append(np.abs(moved.difference - compared.difference).max(axis=0))
    return np.asarray(_SAFETY * np.max(changes, axis=0) + _ROUND_OFF * compared.sizes)


def _explained(layer: Layer, skipped: Collection[str], evidence: _Evidence, time: SearchTime) -> dict[str, Any]:
    """Mistakes that leave a small part of a layer's residual, the best first, and how many were tried.

    Mistakes of the layers before it count where the record does not show these; ``skipped``: their names.
    """
    compared = evidence.difference(layer.name)
    assert not isinstance(compared, str)  # the layer was looked at
    order = list(LAYERS)
    shown = [*(name for name in order[: order.index(layer.name)] if name in skipped), layer.name]
    distance = _norm(evidence, layer.name, evidence.law)
    rounding = float((_bars(layer.name, evidence, compared) / compared.sizes).max())
    most = max(_HELPS * distance, min(rounding, 0.5 * distance))

    def explanation(mistake: Mistake) -> MistakeExplanation | None:
        left, size = best_size(mistake, evidence.law, partial(evidence.left, layer.name))
        return MistakeExplanation(mistake, size, left) if left <= most else None

    candidates = [item for item in mistakes(evidence.law) if _shows(item, shown)]
    several, tried = explanations(candidates, explanation, time)
    ranked = [(item.rank, item.cause) for item in several]
    if "target" in shown and not isinstance(offset := _offset(evidence, layer.name), str):
        ranked.append((2 * offset.after, offset))  # a pose has many numbers: a mistake with fewer goes before
    causes = [cause for _, cause in sorted(ranked, key=lambda item: item[0])]
    if layer.name == "instants" and not causes:
        causes = [*_missed(evidence)]
    return {"causes": tuple(causes), "tried": tried, "known": len(candidates)}


def _shows(mistake: Mistake, layers: Sequence[str]) -> bool:
    """True if a record may show a mistake first at one of the layers; the last of them is looked at."""
    order = list(LAYERS)
    return mistake.layer in layers or (mistake.later and order.index(mistake.layer) + 1 == order.index(layers[-1]))


def _missed(evidence: _Evidence) -> Iterator[LayerCause]:
    """Instants at which the action before acts again, where all others have one."""
    record, law = evidence.record, evidence.law
    changes, due = instant_rows(record, law), _due(record, law)
    period, times = 1 / law.rate, record.time
    others = times[changes] * law.rate
    if not len(due) or np.abs(others - np.round(others)).max() > _SAME_TIME:
        return
    missed = [row for row in due.tolist() if np.abs(times[changes] - times[row]).min() > 0.5 * period]
    if missed:
        words = (
            f"at {counted(len(missed), 'instants')}, first at {times[missed[0]]:.4g} s, the action before acts again"
        )
        yield LayerCause("repeated", words, None, 0.0)


def _offset(evidence: _Evidence, name: str) -> LayerCause | str:
    """Another default pose, as the mean difference of each joint's target."""
    compared = evidence.difference("target")
    if isinstance(compared, str):
        return compared
    offsets = compared.difference.mean(axis=0)
    law = evidence.law
    pose = law.pose + law.signs * offsets
    targets = law.targets if law.policy is not None else tuple((law.signs * pose).tolist())
    distance = _norm(evidence, name, law.change(pose=pose, targets=targets))
    if distance > _HELPS * _norm(evidence, name, law):
        return "no constant offset"
    return LayerCause("pose", offsets_told(law.joints, offsets), None, distance)


def _norm(evidence: _Evidence, name: str, law: ControlLaw) -> float:
    """Largest difference of a layer in parts of the size of its column."""
    return largest(evidence.left(name, law))


def _compared(columns: list[str], time: Array, recorded: Array, computed: Array) -> _Compared:
    sizes = np.maximum(np.abs(recorded).max(axis=0, initial=0.0), np.abs(computed).max(axis=0, initial=0.0))
    sizes = np.maximum(sizes, 1e-3 * sizes.max(initial=0.0))
    return _Compared(tuple(columns), time, recorded - computed, np.where(sizes > 0, sizes, 1.0))


def _told(record: ControlRecord) -> list[str]:
    """Columns that change at instants."""
    return [name for name in record.columns if name.startswith(("action.", "target."))]


def instant_rows(record: ControlRecord, law: ControlLaw) -> Any:
    """Rows at which a record's action or target changes, and the first row if an instant can lie there."""
    names = _told(record)
    if not names:
        near = np.abs(record.time * law.rate - np.round(record.time * law.rate)) < _SAME_TIME
        return np.flatnonzero(near)
    values = np.stack([record.columns[name] for name in names], axis=1)
    changes = np.any(np.abs(np.diff(values, axis=0)) > 0, axis=1)
    later = 1 + np.flatnonzero(changes)
    if record.time[0] != 0 and len(later):  # a record may begin between two instants
        periods = (record.time[later[0]] - record.time[0]) * law.rate
        if abs(periods - np.round(periods)) > _SAME_TIME:
            return later
    return np.concatenate([[0], later])


def _due(record: ControlRecord, law: ControlLaw) -> Any:
    """Rows at instants of a law at which the action, or the target, should change but for rounding."""
    far = np.abs(record.time * law.rate - np.round(record.time * law.rate))
    rows: Any = np.flatnonzero(far < _SAME_TIME)
    rows = rows[rows > 0]
    if not len(rows) or law.extra_steps:
        return rows[:0]
    part = record.part(rows)
    for kind, computed in (("action", _actions), ("target", _targets)):
        recorded = record.stacked(kind, law.joints)
        values = None if recorded is None or (kind == "action" and law.policy is None) else computed(part, law)
        if recorded is not None and values is not None and not isinstance(values, str):
            previous, rounding = recorded[rows - 1], 4 * record.rounding_of(kind, law.joints)[rows]
            values = np.clip(values, recorded.min(axis=0), recorded.max(axis=0))  # what is clipped does not change
            return rows[np.any(np.abs(values - previous) > rounding + _ROUND_OFF, axis=1)]
    return rows[:0]


def _instants(record: ControlRecord, law: ControlLaw) -> _Compared | str:
    if not _told(record):
        return "the record has no columns action.JOINT or target.JOINT, which change at instants"
    time = record.time[instant_rows(record, law)]
    if len(time) < 2:
        return "nothing in the record changes at instants"
    step = law.extra_steps * float(np.diff(record.time).min())
    period = 1 / law.rate + step
    expected = time[0] + period * np.round((time - time[0]) / period)
    rounding = 2 * max(_SAME_TIME * period, float(np.abs(np.diff(record.time) - np.diff(record.time).mean()).max()))
    sizes = np.full(1, min(rounding, 0.1 * float(np.diff(record.time).min())) / _ROUND_OFF)
    due = record.time[_due(record, law)]
    due = due[due <= time[-1] + (1 + _SAME_TIME) * period]  # what comes later may hold on purpose
    lacking = np.array([np.abs(time - instant).min() for instant in due])
    instants = np.concatenate([time[1:], due])
    return _Compared(("time",), instants, np.concatenate([(time - expected)[1:], lacking])[:, None], sizes)


def held_rows(record: ControlRecord, law: ControlLaw) -> Any:
    """True at rows at which no action or target changes."""
    mask = np.ones(len(record.time), bool)
    if _told(record) or law.policy is not None:
        mask[instant_rows(record, law)[1:]] = False
    return mask


def states(record: ControlRecord, law: ControlLaw) -> list[RobotState] | str:
    """States at all rows of a record, or the reason why it has none; without columns of the base it is fixed."""
    q, v = record.stacked("q", law.joints), record.stacked("v", law.joints)
    if q is None or v is None:
        return f"the record has no columns {'q' if q is None else 'v'}.JOINT"
    base_at_rest = {"p_WB": np.zeros(3), "q_WB": np.array([1.0, 0, 0, 0]), "v_WB": np.zeros(3), "w_WB": np.zeros(3)}
    base = {name: record.stacked(name, tuple(axes)) for name, axes in BASE.items()}
    return [
        RobotState(
            time=float(time),
            q=q[row],
            v=v[row],
            **{name: base_at_rest[name] if item is None else item[row] for name, item in base.items()},
        )
        for row, time in enumerate(record.time)
    ]


def _part(observation: Observation, name: str) -> Array:
    return np.asarray(getattr(observation, name))


def _observed(record: ControlRecord, law: ControlLaw) -> tuple[dict[str, Array], list[str]]:
    """Recorded parts of observations, each (times, entries), and all of their columns."""
    parts = {name: record.stacked(f"{OBSERVED}.{name}", law.joints) for name in ("q", "v", "last")}
    parts |= {name: record.stacked(f"{OBSERVED}.{name}", tuple("xyz")) for name in VECTORS}
    recorded = {name: item for name, item in parts.items() if item is not None}
    labels = {name: law.joints if name in {"q", "v", "last"} else tuple("xyz") for name in recorded}
    return recorded, [f"{OBSERVED}.{name}.{label}" for name in recorded for label in labels[name]]


def _observation(record: ControlRecord, law: ControlLaw) -> _Compared | str:
    record = record.part(instant_rows(record, law))
    recorded, columns = _observed(record, law)
    actions = record.stacked("action", law.joints)
    if actions is None or record.time[0] != 0:
        recorded.pop("last", None)
        columns = [name for name in columns if not name.startswith(f"{OBSERVED}.last.")]
    if not recorded:
        return f"the record has no columns {OBSERVED}.…"
    instants = states(record, law)
    if isinstance(instants, str):
        return instants
    if not instants:
        return "no row lies at an instant of the controller"
    no_action = np.zeros((1, len(law.joints)))
    last = np.tile(no_action, (len(instants), 1)) if actions is None else np.concatenate([no_action, actions[:-1]])
    seen = [law.observed(state, action) for state, action in zip(instants, last, strict=True)]
    computed = np.concatenate([np.stack([_part(item, name) for item in seen]) for name in recorded], axis=1)
    return _compared(columns, record.time, np.concatenate([*recorded.values()], axis=1), computed)


def _actions(record: ControlRecord, law: ControlLaw) -> Array | str:
    """Actions of the policy at the rows of a record of instants, from recorded observations where there are some."""
    answer = law.answer()
    assert answer is not None  # the caller knows that there is a policy
    observed = _observed(record, law)[0]
    instants = states(record, law)
    if isinstance(instants, str):
        return instants
    recorded = record.stacked("action", law.joints)
    last = np.zeros(len(law.joints))
    actions = []
    for row, state in enumerate(instants):
        seen = law.observed(state, observed["last"][row] if "last" in observed else last)
        seen = dataclasses.replace(seen, **{name: item[row] for name, item in observed.items()})
        actions.append(np.clip(answer(seen), -law.clip, law.clip))
        last = actions[-1] if recorded is None else recorded[row]
    return np.array(actions)


def _action(record: ControlRecord, law: ControlLaw) -> _Compared | str:
    record = record.part(instant_rows(record, law))
    recorded = record.stacked("action", law.joints)
    if law.policy is None or recorded is None:
        return "the controller has no policy" if law.policy is None else "the record has no columns action.JOINT"
    computed = _actions(record, law)
    if isinstance(computed, str):
        return computed
    columns = [f"action.{name}" for name in law.joints]
    late = int(record.time[0] > 0 and f"{OBSERVED}.last.{law.joints[0]}" not in record.columns)
    return _compared(columns, record.time[late:], recorded[late:], computed[late:])


def _targets(record: ControlRecord, law: ControlLaw) -> Array | str:
    """Targets at the rows of a record of instants, from recorded actions where there are some."""
    counts: list[Array | None] = [None] * len(record.time)
    if law.policy is not None:
        actions = record.stacked("action", law.joints)
        computed = _actions(record, law) if actions is None else actions
        if isinstance(computed, str):
            return computed
        smoothed = np.zeros(len(law.joints)) if record.time[0] == 0 else computed[0]
        for row, action in enumerate(computed):
            counts[row] = smoothed = law.smoothed(action, smoothed)
    times = record.time
    # An action that equals the one before has no row of its own.
    source = np.searchsorted(times, times - (law.delay - _SAME_TIME) / law.rate, side="right") - 1
    targets = [law.pose if row < 0 else law.target(counts[row], float(times[row])) for row in source.tolist()]
    return np.array(targets)


def _target(record: ControlRecord, law: ControlLaw) -> _Compared | str:
    record = record.part(instant_rows(record, law))
    recorded = record.stacked("target", law.joints)
    if recorded is None:
        return "the record has no columns target.JOINT"
    computed = _targets(record, law)
    if isinstance(computed, str):
        return computed
    late = record.time - record.time[0] > (law.delay - 0.5) / law.rate
    counts = np.ones(len(late), bool) if record.time[0] == 0 else late
    columns = [f"target.{name}" for name in law.joints]
    return _compared(columns, record.time[counts], recorded[counts], computed[counts])


def _efforts(record: ControlRecord, law: ControlLaw) -> Array | str:
    """Efforts at all rows, from recorded targets where there are some; NaN where the record does not reach back."""
    q, v = record.stacked("q", law.joints), record.stacked("v", law.joints)
    if q is None or v is None:
        return "the record has no columns q.JOINT and v.JOINT"
    target, rows, instants = record.stacked("target", law.joints), np.arange(len(q)), instant_rows(record, law)
    places = np.searchsorted(instants, rows, side="right") - 1
    if target is None:
        if record.time[0] != 0 or (law.policy is None and not _told(record) and not len(instants)):
            return "the record has no columns target.JOINT"
        computed = _targets(record.part(instants), law)
        if isinstance(computed, str):
            return computed
        target = computed[places]
    seen = np.where(places < 0, -1, instants[places]) if law.hold_effort else rows
    seen = seen - law.lag
    efforts = law.effort(target, q[seen], v[seen])
    efforts[seen < 0] = np.nan
    return efforts


def _effort(record: ControlRecord, law: ControlLaw) -> _Compared | str:
    recorded = record.stacked("effort", law.joints)
    if recorded is None:
        return "the record has no columns effort.JOINT"
    computed = _efforts(record, law)
    if isinstance(computed, str):
        return computed
    rows = np.isfinite(computed).all(axis=1)
    columns = [f"effort.{name}" for name in law.joints]
    return _compared(columns, record.time[rows], recorded[rows], computed[rows])


_DIFFERENCES: dict[str, Callable[[ControlRecord, ControlLaw], _Compared | str]] = {
    "instants": _instants,
    "observation": _observation,
    "action": _action,
    "target": _target,
    "effort": _effort,
}
