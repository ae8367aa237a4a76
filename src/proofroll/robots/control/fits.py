"""Linear fits of a layer to what it is computed from: gains, biases and limits of each joint, scales and poses."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proofroll.core.number_format import with_bar
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import offsets_told, orders
from proofroll.robots.control.record import LayerCause
from proofroll.robots.model import Array

Flags = NDArray[np.bool_]
_ROWS = 2  # rows for each number of a joint at least
_SAME = 1e-3  # relative difference of two numbers of joints that are told as one, and least one that is told
_SMALL = 1e-9  # part of a column that is round-off
_LEAST = 1e-6  # relative difference of a number of a servo that is told, where the record is as sharp
_TOLD = 1e-5  # least relative bar of a number that is told beside it
_SAFETY = 5.0  # on the errors of fitted numbers
_RANK = 1e-4  # least part of the inputs of a servo along which they vary, for its numbers to be known


@dataclass(frozen=True)
class ServoRows:
    """Inputs and outputs of servos, each (times, joints).

    Attributes:
        target, q, v: targets, coordinates and rates that a servo has in a row.
        effort: of the record.
    """

    target: Array
    q: Array
    v: Array
    effort: Array


def observation_causes(
    columns: Sequence[str], recorded: Array, difference: Array, sizes: Array, most: float
) -> Iterator[LayerCause]:
    """Columns of an observation that are each a part of the right ones, or differ by a constant.

    Args:
        columns: their names.
        recorded: values, (times, columns).
        difference: of these from the right ones.
        sizes: of the columns.
        most: largest difference that a mistake may leave, in parts of the sizes.
    """
    right = recorded - difference
    squares = (right**2).sum(axis=0)
    factors = np.where(squares > 0, (right * recorded).sum(axis=0) / np.where(squares > 0, squares, 1.0), 1.0)
    wrong_columns = np.asarray((np.abs(difference) > most * sizes).any(axis=0), bool)
    added = difference.mean(axis=0)
    spread = ((right - right.mean(axis=0)) ** 2).sum(axis=0)
    slopes = ((right - right.mean(axis=0)) * recorded).sum(axis=0) / np.where(spread > 0, spread, np.inf)
    beside = recorded.mean(axis=0) - slopes * right.mean(axis=0)
    for name, words, explained, numbers, unit in (
        ("observed_size", "parts are observed at another size: ", factors * right, factors, " of the right one"),
        ("observed_offset", "parts are observed with a constant added: ", right + added, added, ""),
    ):
        residual = float((np.abs(recorded - explained) / sizes).max())
        if residual <= most and len(recorded) > _ROWS:  # of a column that hardly varies, what leaves less goes before
            listed = _listed(numbers, wrong_columns, columns, unit)
            yield LayerCause(name, words + listed, None, residual, numbers=int(wrong_columns.sum()))
    explained = np.where(wrong_columns, slopes * right + beside, right)
    residual = float((np.abs(recorded - explained) / sizes).max())
    if residual <= most and len(recorded) > 2 * _ROWS and np.all(np.abs(slopes[wrong_columns]) > _SAME):
        sizes_told = _listed(slopes, wrong_columns, columns, " of the right one")
        words = f"parts are observed at another size and with a constant added: {sizes_told}; constants: "
        listed = words + _listed(beside, wrong_columns, columns)
        yield LayerCause("observed_normalised", listed, None, residual, numbers=2 * int(wrong_columns.sum()))


def servo_causes(rows: ServoRows, law: ControlLaw, most: float) -> Iterator[LayerCause]:
    """Mistakes of efforts.

    Args:
        rows: of the record.
        law: as it should be.
        most: largest difference that a mistake may leave, in parts of the largest effort of each joint.
    """
    right = law.effort(rows.target, rows.q, rows.v)
    sizes = _sizes(rows.effort)

    def left(efforts: Array, recorded: Array = rows.effort) -> float:
        return float(np.abs((efforts - recorded) / sizes).max())

    if len(right) > 1 and (late := left(right[:-1], rows.effort[1:])) <= most:
        yield LayerCause("late_effort", "efforts are those of the row before", None, late)
    yield from _other_targets(rows, law, most, left)
    yield from _falling_limit(rows, law, most, left)
    yield from _dead_band(rows, law, most, left)
    if (order := _order(right, rows.effort, most)) is not None and (after := left(right[:, order])) <= most:
        words = _order_words(law.joints, order)
        yield LayerCause("effort_order", f"efforts are of joints in another order ({words})", None, after)
    fit = _ServoFit.of(rows, law, np.asarray((np.abs(right - rows.effort) > most * sizes).any(axis=0), bool), most)
    clauses = [] if fit is None else fit.clauses(law, lambda size: left(size * right) <= most)
    if fit is not None and clauses and (after := left(fit.efforts(rows))) <= most:
        size = fit.size if len(clauses) == 1 else None
        yield LayerCause("servo", "; ".join(clauses), size, after, numbers=len(clauses))


def ramps(goals: Array) -> Iterator[Array]:
    """Targets at all rows that are reached along straight lines from an instant to the next; NaN before the second.

    A line ends at the last row before the next instant, or at that one. ``goals``: targets that hold from each instant
    on, (times, joints).
    """
    begins = np.flatnonzero(np.any(np.diff(goals, axis=0) != 0, axis=1)) + 1
    if len(begins) < _ROWS:
        return
    period = int(np.diff(begins).min())
    place = np.searchsorted(begins, np.arange(len(goals)), side="right") - 1
    since = np.arange(len(goals)) - begins[place]
    for lead in (1, 0):
        part = np.minimum((since + lead) / period, 1.0)[:, None]
        starts = goals[begins[place] - 1]
        yield np.where((place >= 0)[:, None], starts + part * (goals - starts), np.nan)


def _other_targets(
    rows: ServoRows, law: ControlLaw, most: float, left: Callable[[Array, Array], float]
) -> Iterator[LayerCause]:
    """Efforts by targets that come some rows late within an instant, or along a ramp."""
    changes = np.flatnonzero(np.any(np.diff(rows.target, axis=0) != 0, axis=1))
    period = int(np.diff(changes).min()) if len(changes) > 1 else 0
    for late in range(1, period):
        efforts = law.effort(rows.target[:-late], rows.q[late:], rows.v[late:])
        if (residual := left(efforts, rows.effort[late:])) <= most:
            yield LayerCause("late_rows", f"targets act {late} rows late", float(late), residual)
            break
    for target in ramps(rows.target):
        rows_told = np.isfinite(target).all(axis=1)
        efforts = law.effort(target[rows_told], rows.q[rows_told], rows.v[rows_told])
        if (residual := left(efforts, rows.effort[rows_told])) <= most:
            words = "servos follow targets along a straight line from one instant to the next"
            yield LayerCause("ramped", words, None, residual)


def _falling_limit(
    rows: ServoRows, law: ControlLaw, most: float, left: Callable[[Array], float]
) -> Iterator[LayerCause]:
    """Efforts whose limit falls with the speed, as that of a DC motor: F (1 - v / v0) along the effort, 0 at least.

    The limit of the law holds beside it.
    """
    plain = law.kp * (rows.target - rows.q) - law.kd * rows.v
    sign = np.sign(plain)
    cut = np.abs(rows.effort - plain) > most * _sizes(rows.effort)
    falls = cut & (np.abs(np.abs(rows.effort) - law.limit) > most * _sizes(rows.effort)) & (rows.effort != 0)
    speeds, forces = (sign * rows.v)[falls], (sign * rows.effort)[falls]
    if len(speeds) < 2 * _ROWS or np.ptp(speeds) <= _SAME * np.abs(speeds).max():
        return
    slope, stall = np.polyfit(speeds, forces, 1)
    if not (slope < 0 < stall and -slope * np.ptp(speeds) > _SAME * stall):
        return
    most_effort = np.clip(stall + slope * sign * rows.v, 0.0, law.limit)
    if (residual := left(sign * np.minimum(np.abs(plain), most_effort))) <= most:
        numbers = f"{stall:.4g} at rest, 0 at a speed of {-stall / slope:.4g}"
        words = f"the limit of efforts falls with the speed along them: {numbers}"
        yield LayerCause("falling_limit", words, None, residual, numbers=2)


def _dead_band(rows: ServoRows, law: ControlLaw, most: float, left: Callable[[Array], float]) -> Iterator[LayerCause]:
    """Efforts without the part of kp where a joint is near its target."""
    apart, sizes = rows.target - rows.q, _sizes(rows.effort)
    damping = law.effort(rows.q, rows.q, rows.v)
    widths = np.where(np.abs(rows.effort - damping) <= most * sizes, np.abs(apart), 0.0).max(axis=0)
    right = law.effort(rows.target, rows.q, rows.v)
    wrong_joints = np.asarray((np.abs(right - rows.effort) > most * sizes).any(axis=0), bool)
    wrong_joints &= widths < np.abs(apart).max(axis=0)
    efforts = np.where((np.abs(apart) <= widths) & wrong_joints, damping, right)
    if wrong_joints.any() and (residual := left(efforts)) <= most:
        words = f"kp does nothing near a target, up to at least: {_listed(widths, wrong_joints, law.joints)}"
        yield LayerCause("dead_band", words, None, residual, numbers=int(wrong_joints.sum()))


def _order(computed: Array, recorded: Array, most: float) -> list[int] | None:
    """Column of computed values (times, joints) that each recorded one has; None: they are no others in another order.

    ``most``: largest difference, in parts of the size of a recorded column.
    """
    scaled, columns = computed[..., None] / _sizes(recorded), (recorded / _sizes(recorded)).T
    apart = [np.abs(scaled[..., k] - column[:, None]).max(axis=0) for k, column in enumerate(columns)]
    order = [k if parts[k] <= most else int(np.argmin(parts)) for k, parts in enumerate(apart)]
    return order if sorted(order) == [*range(len(order))] != order else None


def _order_words(joints: Sequence[str], order: Sequence[int]) -> str:
    """Words for an order: those of a known one, or the joints that have others' numbers."""
    moved = ", ".join(f"{joints[k]} has that of {joints[place]}" for k, place in enumerate(order) if place != k)
    return next((words for words, known in orders(tuple(joints)) if [*known] == [*order]), moved)


@dataclass
class _ServoFit:
    """Servos whose numbers were fitted, each (joints,): effort = bias + clamped(kp (target - q) - kd v).

    ``other``: joints whose efforts are not the law's; the numbers of the rest are the law's. ``bars``: of the gains and
    the bias, (3, joints).
    """

    other: Flags
    kp: Array
    kd: Array
    bias: Array
    limit: Array
    bars: Array
    size: float | None = None

    @classmethod
    def of(cls, rows: ServoRows, law: ControlLaw, other: Flags, most: float) -> _ServoFit | None:
        """The fit; None: too few rows are beside a clamp, or they do not tell the numbers of a joint.

        Args:
            rows: of the record.
            law: as it should be.
            other: joints whose efforts are not its own.
            most: largest difference that a fit may leave, in parts of the largest effort of each joint.
        """
        fit = cls(
            other=other,
            kp=law.kp.copy(),
            kd=law.kd.copy(),
            bias=np.zeros(len(other)),
            limit=np.array(law.limit, float),
            bars=np.zeros((3, len(other))),
        )
        for k in np.flatnonzero(other).tolist():
            effort = rows.effort[:, k]
            columns = np.stack([rows.target[:, k] - rows.q[:, k], -rows.v[:, k], np.ones(len(effort))], axis=1)
            free = ~_at_ends(effort)
            if free.sum() < _ROWS * columns.shape[1]:
                return None
            scale = np.maximum(np.abs(columns[free]).max(axis=0), 1e-300)
            numbers, _, rank, _ = np.linalg.lstsq(columns[free] / scale, effort[free], rcond=_RANK)
            if rank < columns.shape[1]:
                return None
            fit.kp[k], fit.kd[k], fit.bias[k] = numbers / scale
            noise = float(np.abs(columns[free] @ (numbers / scale) - effort[free]).max())
            inverse = np.linalg.inv(columns[free].T @ columns[free] / np.outer(scale, scale))
            fit.bars[:, k] = _SAFETY * noise * np.sqrt(np.diag(inverse)) / scale
            unbounded = float(np.abs(columns @ (numbers / scale) - effort).max())
            clamped = unbounded > most * float(np.abs(effort).max())
            fit.limit[k] = float(np.abs(effort[~free] - fit.bias[k]).max(initial=0.0)) if clamped else np.inf
        return fit

    def efforts(self, rows: ServoRows) -> Array:
        """Efforts of the fit, (times, joints)."""
        plain = self.kp * (rows.target - rows.q) - self.kd * rows.v
        return np.asarray(self.bias + np.clip(plain, -self.limit, self.limit))

    def clauses(self, law: ControlLaw, whole: Callable[[float], bool]) -> list[str]:
        """Clauses on the numbers that are not the law's; efforts that are all one part of the right ones have one.

        ``whole``: True if a size of all efforts, limits included, explains them.
        """
        parts = {"kp": (self.kp, law.kp), "kd": (self.kd, law.kd)}
        factors = {name: _factors(found, right) for name, (found, right) in parts.items() if right.any()}
        clamped = np.isfinite(self.limit) & self.other
        factors["limit"] = np.where(clamped, _factors(np.where(clamped, self.limit, 1.0), law.limit), 1.0)
        largest = np.where(np.isfinite(law.limit), law.limit, np.abs(law.kp))
        biased = np.abs(self.bias) > np.maximum(self.bars[2], _LEAST * largest)
        bars = {"kp": _relative(self.bars[0], law.kp), "kd": _relative(self.bars[1], law.kd)}
        gains = np.concatenate([factors[name] for name in parts if name in factors])
        scaled = np.concatenate([gains, np.sign(gains[:1]) * factors["limit"][clamped]])
        if self.other.all() and len(factors) > 2 and not biased.any() and _alike(scaled) and abs(scaled[0] - 1) > _SAME:
            self.size = float(scaled.mean())
            if not clamped.any() and self.size > 0:
                way = ", or efforts are," if whole(self.size) else ""
                return [f"kp and kd are both{way} {self.size:.5g} of the right ones"]
            if np.isclose(self.size, -1, atol=_SAME):
                return ["efforts have the other sign"]
            return [f"efforts are {self.size:.5g} of the right ones"]
        clauses = []
        words = {"kp": "kp", "kd": "kd", "limit": "the limit of efforts"}
        for name, values in factors.items():
            clauses += _factor_clause(words[name], values, law.joints, bars.get(name, _SAME))
        if biased.any():
            clauses.append("efforts have a constant part beside the servo's: " + _listed(self.bias, biased, law.joints))
        return clauses


def target_causes(
    targets: Array, actions: Array, q: Array | None, law: ControlLaw, most: float
) -> Iterator[LayerCause]:
    """Mistakes of what actions mean.

    Args:
        targets: at successive instants, (times, joints).
        actions: of the same instants, (times, joints).
        q: coordinates at these instants; None: the record has none.
        law: as it should be.
        most: largest difference that a mistake may leave, in parts of the largest target of each joint.
    """
    sizes = _sizes(targets)

    def left(computed: Array, rows: slice = slice(None)) -> float:
        return float(np.abs((computed - targets[rows]) / sizes).max())

    if (after := left(law.pose + law.scale * np.tanh(actions))) <= most:
        yield LayerCause("squashed", "actions pass a tanh", None, after)
    if q is not None and (after := left(q + law.scale * actions)) <= most:
        words = "actions are added to the present coordinates, not to the default pose"
        yield LayerCause("added", words, None, after)
    yield from _remembering(targets, actions, law, most, left)
    order = _order(law.scale * actions, targets - law.pose, most)
    if order is not None and (after := left(law.pose + law.scale * actions[:, order])) <= most:
        words = _order_words(law.joints, order)
        yield LayerCause("joint_order", f"actions are for joints in another order ({words})", None, after)
    affine = _affine(targets, actions)
    if affine is None:
        return
    scale, offset = affine
    clauses = _factor_clause("the scale of actions", scale / law.scale, law.joints)
    if np.allclose(scale / law.scale, -1, atol=_SAME) and np.abs(offset - law.pose).max() <= _SAME:
        clauses = ["actions have the other sign"]
    moved = offset - law.pose
    if np.abs(moved).max() > _SAME * max(1e-3, float(np.abs(targets).max())):
        clauses.append(offsets_told(law.joints, moved))
    if clauses and (after := left(offset + scale * actions)) <= most:
        size = float((scale / law.scale).mean()) if len(clauses) == 1 and _alike(scale) else None
        yield LayerCause("affine_target", "; ".join(clauses), size, after, numbers=len(clauses))


def _remembering(
    targets: Array, actions: Array, law: ControlLaw, most: float, left: Callable[[Array, slice], float]
) -> Iterator[LayerCause]:
    """Targets that keep a part of the target before, or of the action before."""
    if len(targets) < 3:
        return
    moved, new = targets - law.pose, law.scale * actions
    for name, previous, words in (
        ("smoothing", moved[:-1], "actions pass a filter, of which {new:.5g} is new at each instant"),
        ("mixed_actions", new[:-1], "targets mix {new:.5g} of an action with {old:.5g} of the one before"),
    ):
        columns = np.stack([new[1:].ravel(), previous.ravel()], axis=1)
        part, rest = np.linalg.lstsq(columns, moved[1:].ravel(), rcond=_SMALL)[0]
        residual = left(law.pose + part * new[1:] + rest * previous, slice(1, None))
        if residual <= most and abs(rest) > _SAME:
            yield LayerCause(name, words.format(new=part, old=rest), float(part), residual, numbers=2)


def _affine(targets: Array, actions: Array) -> tuple[Array, Array] | None:
    """Scale and offset of each joint's target in its action; None: there are too few instants."""
    if len(targets) < 2 * _ROWS:
        return None
    centred = actions - actions.mean(axis=0)
    squares = (centred**2).sum(axis=0)
    if not np.all(squares > _SMALL * np.maximum(np.abs(actions).max(axis=0), 1e-300) ** 2):
        return None
    scale = (centred * targets).sum(axis=0) / squares
    return scale, targets.mean(axis=0) - scale * actions.mean(axis=0)


def _at_ends(effort: Array) -> Flags:
    """True where an effort is the largest or the least of its joint, and several rows have it: it is clamped."""
    mask = np.zeros(len(effort), bool)
    for end in (effort.max(), effort.min()):
        alike = np.abs(effort - end) <= _SMALL * max(abs(end), 1e-300)
        mask |= alike if alike.sum() > 1 else False
    return mask


def _sizes(values: Array) -> Array:
    """Largest size of each column, at least a thousandth of all."""
    sizes = np.abs(values).max(axis=0)
    return np.asarray(np.maximum(sizes, 1e-3 * sizes.max(initial=0.0)) + 1e-300)


def _factors(found: Array, right: Array) -> Array:
    """Numbers in parts of the right ones; 1 where the right one is 0, or has no bound."""
    sensible = (right != 0) & np.isfinite(right)
    return np.where(sensible, found / np.where(sensible, right, 1.0), 1.0)


def _relative(bars: Array, right: Array) -> Array:
    return np.where(right != 0, bars / np.where(right != 0, np.abs(right), 1.0), 0.0)


def _alike(values: Array) -> bool:
    return bool(len(values)) and float(np.ptp(values)) <= _SAME * float(np.abs(values).max())


def _factor_clause(what: str, factors: Array, joints: Sequence[str], bars: Array | float = _SAME) -> list[str]:
    """Clause on factors that are not 1, one number for all joints where they are alike; empty where all are 1.

    ``bars``: of the factors.
    """
    wrong_joints = np.abs(factors - 1) > np.maximum(bars, _LEAST)
    if not wrong_joints.any():
        return []
    if wrong_joints.all() and _alike(factors):
        bar = float(np.max(bars)) if np.ndim(bars) else 0.0
        text = "{} ± {}".format(*with_bar(factors.mean(), bar, 1)) if bar > _TOLD else f"{factors.mean():.5g}"
        return [f"{what} is {text} of the right one"]
    return [f"{what} is another: {_listed(factors, wrong_joints, joints, ' of the right one')}"]


def _listed(values: Array, chosen: Flags, joints: Sequence[str], unit: str = "") -> str:
    """Joints with their numbers; joints with one number stand together."""
    groups: list[tuple[float, list[str]]] = []
    for k in np.flatnonzero(chosen).tolist():
        for value, names in groups:
            if abs(value - values[k]) <= _SAME * abs(value):
                names.append(joints[k])
                break
        else:
            groups.append((float(values[k]), [joints[k]]))
    return "; ".join(f"{', '.join(names)} {value:.5g}{unit}" for value, names in groups)
