"""Layers of a record of a robot under a controller, each computed from those before it, without a simulation."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.number_format import with_bar
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.bookkeeping.law import VECTORS, ControlLaw, RobotState
from proofroll.elements.mechanism.bookkeeping.mistakes import IMPLICIT, Mistake, fitted, mistakes, offsets_told
from proofroll.elements.mechanism.scene.policy import Observation
from proofroll.robots.air_fit import acceleration_fit
from proofroll.robots.control_motion import motion_layer
from proofroll.robots.control_record import BASE, OBSERVED, ControlRecord
from proofroll.robots.model import Array
from proofroll.robots.record_layer import Layer, LayerCause

# Least residual that counts, in parts of the largest number of its column: round-off of a sum of some terms.
_ROUND_OFF = 1e-9
# Number of random roundings of a record that give the bar of a layer, and the factor on their largest change.
_ROUNDINGS, _SAFETY = 6, 3.0
# A cause counts if it leaves less than this part of a residual, or no more than the bar.
_HELPS = 0.1
_SAME_TIME = 1e-6  # part of the time between instants that is round-off


@dataclass(frozen=True)
class _Compared:
    """Differences of a layer with its columns: ``difference`` (times, columns), in their units, and their sizes.

    ``remark``: on what the record cannot tell.
    """

    columns: tuple[str, ...]
    time: Array
    difference: Array
    sizes: Array
    remark: str = ""


def record_layers(record: ControlRecord, law: ControlLaw, mechanism: Mechanism, *, grounded: bool) -> list[Layer]:
    """All layers of a record, with causes at the first that does not hold.

    Args:
        record: of a run under the law.
        law: the law as it should be.
        mechanism: the robot.
        grounded: True if something else than servos and gravity acts on the robot.
    """
    evidence = _Evidence(record, law, mechanism)
    layers: list[Layer] = []
    failed = False
    for name in _DIFFERENCES:
        if name == "acceleration" and grounded:
            layers.append(Layer(name, reason="the robot touches the ground, whose forces no record has"))
            continue
        layer = _layer(name, evidence)
        if not layer.holds and not failed:
            causes = _of_fit(evidence) if name == "acceleration" else _causes(layer, evidence)
            layer, failed = dataclasses.replace(layer, causes=tuple(causes)), True
        layers.append(layer)
    lacking = {layer.name for layer in layers if layer.residual is None}
    if not failed and not grounded and lacking & {"target", "effort"}:
        layers.append(motion_layer(record, law, mechanism))
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
        return _DIFFERENCES[name](record or self.record, law or self.law, self.mechanism)


def _layer(name: str, evidence: _Evidence) -> Layer:
    compared = evidence.difference(name)
    if not isinstance(compared, str) and not len(compared.time):
        compared = "no row that counts lies at an instant of the controller"
    if isinstance(compared, str):
        return Layer(name, reason=compared)
    # What rounding does to accelerations is in the error bars of their fit.
    bars = compared.sizes * _ROUND_OFF if name == "acceleration" else _bars(name, evidence, compared)
    parts = np.abs(compared.difference) / bars
    row, column = np.unravel_index(int(np.argmax(parts)), parts.shape)
    residual, bar = abs(float(compared.difference[row, column])), float(bars[column])
    return Layer(
        name=name,
        residual=residual,
        bar=bar,
        column=compared.columns[column],
        time=float(compared.time[row]),
        reason=compared.remark,
    )


def _bars(name: str, evidence: _Evidence, compared: _Compared) -> Array:
    """Difference of each column that the rounding of the record explains."""
    generator = np.random.default_rng(0)
    changes = [np.zeros(len(compared.columns))]
    for _ in range(_ROUNDINGS):
        moved = evidence.difference(name, record=evidence.record.rounded(generator))
        if isinstance(moved, _Compared) and moved.difference.shape == compared.difference.shape:
            changes.append(np.abs(moved.difference - compared.difference).max(axis=0))
    return np.asarray(_SAFETY * np.max(changes, axis=0) + _ROUND_OFF * compared.sizes)


def _causes(layer: Layer, evidence: _Evidence) -> Iterator[LayerCause]:
    """Mistakes of a layer that leave a small part of its residual, the best first."""
    found: list[tuple[float, LayerCause]] = []
    compared = evidence.difference(layer.name)
    assert not isinstance(compared, str)  # the layer was looked at
    before = _norm(evidence, layer.name, evidence.law)
    rounding = float((_bars(layer.name, evidence, compared) / compared.sizes).max())
    if layer.name == "target" and not isinstance(offset := _offset(evidence, compared), str):
        found.append((2 * offset.after, offset))  # a pose has many numbers: a mistake with fewer goes before
    for mistake in mistakes(evidence.law):
        if mistake.layer != layer.name:
            continue
        size, after = _best_size(mistake, evidence)
        if after <= max(_HELPS * before, min(rounding, 0.5 * before)):
            cause = LayerCause(mistake.id, mistake.sentence(size), size if mistake.sized else None, after)
            found.append((after, cause))
    yield from (cause for _, cause in sorted(found, key=lambda item: item[0]))


def _offset(evidence: _Evidence, compared: _Compared) -> LayerCause | str:
    """Another default pose, as the mean difference of each joint's target."""
    offsets = compared.difference.mean(axis=0)
    law = evidence.law
    pose = law.pose + law.signs * offsets
    targets = law.targets if law.policy is not None else tuple((law.signs * pose).tolist())
    after = _norm(evidence, "target", law.change(pose=pose, targets=targets))
    if after > _HELPS * _norm(evidence, "target", law):
        return "no constant offset"
    return LayerCause("pose", offsets_told(law.joints, offsets), None, after)


def _of_fit(evidence: _Evidence) -> Iterator[LayerCause]:
    """Parameters of the fit in the air that are not the law's."""
    fit = acceleration_fit(evidence.record, evidence.law, evidence.mechanism)
    assert not isinstance(fit, str)  # the layer was looked at
    parts = np.abs(fit.values - fit.right) / fit.errors
    for at in np.argsort(-parts):
        if parts[at] <= 1:
            continue
        name, value, error = fit.names[at], float(fit.values[at]), float(fit.errors[at])
        unit = " kg m²" if name == "armature" and not fit.right[at] else " of the right one"
        text, bar = with_bar(value, error, 1)
        yield LayerCause(name.split()[0], f"the {name} is {text} ± {bar}{unit}", value, 0.0)


def _best_size(mistake: Mistake, evidence: _Evidence) -> tuple[float, float]:
    """Size of a mistake that fits a record best, and the residual with it."""

    def residual(size: float) -> Array:
        compared = evidence.difference(mistake.layer, mistake.changed(evidence.law, size))
        return np.array(np.nan) if isinstance(compared, str) else (compared.difference / compared.sizes).ravel()

    sizes = [fitted(residual, start) for start in mistake.starts] if mistake.sized else [1.0]
    pairs = [(size, _norm(evidence, mistake.layer, mistake.changed(evidence.law, size))) for size in sizes]
    return min(pairs, key=lambda pair: pair[1])


def _norm(evidence: _Evidence, name: str, law: ControlLaw) -> float:
    """Largest difference of a layer in parts of the size of its column."""
    compared = evidence.difference(name, law)
    if isinstance(compared, str):
        return math.inf
    return float(np.abs(compared.difference / compared.sizes).max())


def _compared(columns: list[str], time: Array, given: Array, computed: Array) -> _Compared:
    sizes = np.maximum(np.abs(given).max(axis=0, initial=0.0), np.abs(computed).max(axis=0, initial=0.0))
    sizes = np.maximum(sizes, 1e-3 * sizes.max(initial=0.0))
    return _Compared(tuple(columns), time, given - computed, np.where(sizes > 0, sizes, 1.0))


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
    changed = np.any(np.abs(np.diff(values, axis=0)) > 0, axis=1)
    later = 1 + np.flatnonzero(changed)
    if record.time[0] != 0 and len(later):  # a record may begin between two instants
        periods = (record.time[later[0]] - record.time[0]) * law.rate
        if abs(periods - np.round(periods)) > _SAME_TIME:
            return later
    return np.concatenate([[0], later])


def _instants(record: ControlRecord, law: ControlLaw, _: Mechanism) -> _Compared | str:
    if not _told(record):
        return "the record has no columns action.JOINT or target.JOINT, which change at instants"
    time = record.time[instant_rows(record, law)]
    if len(time) < 2:
        return "nothing in the record changes at instants"
    period = 1 / law.rate
    step = law.extra_steps * float(np.diff(record.time).min())
    expected = time[0] + (period + step) * np.round((time - time[0]) / (period + step))
    rounding = 2 * max(_SAME_TIME * period, float(np.abs(np.diff(record.time) - np.diff(record.time).mean()).max()))
    sizes = np.full(1, min(rounding, 0.1 * float(np.diff(record.time).min())) / _ROUND_OFF)
    return _Compared(("time",), time[1:], (time - expected)[1:, None], sizes)


def states(record: ControlRecord, law: ControlLaw) -> list[RobotState] | str:
    """States at all rows of a record, or the reason why it has none; without columns of the base it is fixed."""
    q, v = record.stacked("q", law.joints), record.stacked("v", law.joints)
    if q is None or v is None:
        return f"the record has no columns {'q' if q is None else 'v'}.JOINT"
    still = {"p_WB": np.zeros(3), "q_WB": np.array([1.0, 0, 0, 0]), "v_WB": np.zeros(3), "w_WB": np.zeros(3)}
    base = {name: record.stacked(name, tuple(axes)) for name, axes in BASE.items()}
    return [
        RobotState(
            time=float(time),
            q=q[row],
            v=v[row],
            **{name: still[name] if item is None else item[row] for name, item in base.items()},
        )
        for row, time in enumerate(record.time)
    ]


def _part(observation: Observation, name: str) -> Array:
    return np.asarray(getattr(observation, name))


def _observed(record: ControlRecord, law: ControlLaw) -> tuple[dict[str, Array], list[str]]:
    """Recorded parts of observations, each (times, entries), and all of their columns."""
    parts = {name: record.stacked(f"{OBSERVED}.{name}", law.joints) for name in ("q", "v", "last")}
    parts |= {name: record.stacked(f"{OBSERVED}.{name}", tuple("xyz")) for name in VECTORS}
    given = {name: item for name, item in parts.items() if item is not None}
    labels = {name: law.joints if name in {"q", "v", "last"} else tuple("xyz") for name in given}
    return given, [f"{OBSERVED}.{name}.{label}" for name in given for label in labels[name]]


def _observation(record: ControlRecord, law: ControlLaw, _: Mechanism) -> _Compared | str:
    record = record.part(instant_rows(record, law))
    given, columns = _observed(record, law)
    given.pop("last", None)
    columns = [name for name in columns if not name.startswith(f"{OBSERVED}.last.")]
    if not given:
        return f"the record has no columns {OBSERVED}.…"
    at = states(record, law)
    if isinstance(at, str):
        return at
    if not at:
        return "no row lies at an instant of the controller"
    seen = [law.observed(state, np.zeros(len(law.joints))) for state in at]
    computed = np.concatenate([np.stack([_part(item, name) for item in seen]) for name in given], axis=1)
    return _compared(columns, record.time, np.concatenate([*given.values()], axis=1), computed)


def _actions(record: ControlRecord, law: ControlLaw) -> Array | str:
    """Actions of the policy at the rows of a record of instants, from recorded observations where there are some."""
    answer = law.answer()
    assert answer is not None  # the caller knows that there is a policy
    given = _observed(record, law)[0]
    at = states(record, law)
    if isinstance(at, str):
        return at
    recorded = record.stacked("action", law.joints)
    last = np.zeros(len(law.joints))
    actions = []
    for row, state in enumerate(at):
        seen = law.observed(state, given["last"][row] if "last" in given else last)
        seen = dataclasses.replace(seen, **{name: item[row] for name, item in given.items()})
        actions.append(np.asarray(answer(seen)))
        last = actions[-1] if recorded is None else recorded[row]
    return np.array(actions)


def _action(record: ControlRecord, law: ControlLaw, _: Mechanism) -> _Compared | str:
    record = record.part(instant_rows(record, law))
    given = record.stacked("action", law.joints)
    if law.policy is None or given is None:
        return "the controller has no policy" if law.policy is None else "the record has no columns action.JOINT"
    computed = _actions(record, law)
    if isinstance(computed, str):
        return computed
    columns = [f"action.{name}" for name in law.joints]
    late = int(record.time[0] > 0 and f"{OBSERVED}.last.{law.joints[0]}" not in record.columns)
    return _compared(columns, record.time[late:], given[late:], computed[late:])


def _target(record: ControlRecord, law: ControlLaw, _: Mechanism) -> _Compared | str:
    record = record.part(instant_rows(record, law))
    given = record.stacked("target", law.joints)
    if given is None:
        return "the record has no columns target.JOINT"
    actions: Array | None = None
    if law.policy is not None:
        actions = record.stacked("action", law.joints)
        computed_actions = _actions(record, law) if actions is None else actions
        if isinstance(computed_actions, str):
            return computed_actions
        actions = computed_actions
    times = record.time.tolist()
    targets = [law.target(None if actions is None else actions[row], time) for row, time in enumerate(times)]
    first = 0 if record.time[0] == 0 else law.delay
    computed = np.array([*([law.pose] * law.delay), *targets][: len(targets)])
    columns = [f"target.{name}" for name in law.joints]
    return _compared(columns, record.time[first:], given[first:], computed[first:])


def _effort(record: ControlRecord, law: ControlLaw, _: Mechanism) -> _Compared | str:
    given, target = record.stacked("effort", law.joints), record.stacked("target", law.joints)
    if given is None or target is None:
        return f"the record has no columns {'effort' if given is None else 'target'}.JOINT"
    q, v = record.stacked("q", law.joints), record.stacked("v", law.joints)
    if q is None or v is None:
        return "the record has no columns q.JOINT and v.JOINT"
    rows = np.arange(len(q))
    if law.hold_effort:
        instants = instant_rows(record, law)
        rows = instants[np.searchsorted(instants, rows, side="right") - 1]
        rows[: instants[0]] = -1  # since an instant before the record
    seen = rows - law.lag
    computed = law.effort(target, q[seen], v[seen])
    columns = [f"effort.{name}" for name in law.joints]
    return _compared(columns, record.time[seen >= 0], given[seen >= 0], computed[seen >= 0])


def _acceleration(record: ControlRecord, law: ControlLaw, mechanism: Mechanism) -> _Compared | str:
    fit = acceleration_fit(record, law, mechanism)
    if isinstance(fit, str):
        return fit
    remark = IMPLICIT if fit.imitated else ""
    difference = (fit.values - fit.right)[None]
    return _Compared(
        columns=fit.names,
        time=np.array([record.time[0]]),
        difference=difference,
        sizes=fit.errors / _ROUND_OFF,
        remark=remark,
    )


_DIFFERENCES: dict[str, Callable[[ControlRecord, ControlLaw, Mechanism], _Compared | str]] = {
    "instants": _instants,
    "observation": _observation,
    "action": _action,
    "target": _target,
    "effort": _effort,
    "acceleration": _acceleration,
}
