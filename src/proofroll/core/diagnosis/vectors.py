"""Errors in reporting a vector or its times: sign, unit, axes, frame, limit, a shift, a factor on all times.

Each test applies one such mistake to the true vectors and compares the result with the engine's report. So it needs no
equations of motion, and agreement is proof by itself. At other times the truth is a spline through its samples; the
first and last ones, for which it would have to be extrapolated, are left out.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from proofroll.core.arrays import FloatArray, known_difference
from proofroll.core.diagnosis import CLOSES, Cause, Difference, above_round_off
from proofroll.core.diagnosis.fitting import change_by, factor_text, known_factor, least_squares_parameter

_SPLINE = 5
# Fewest samples that determine a shift; from _MANY on the degree of the spline is left out at each end, else _END.
_FEWEST, _MANY, _END = 9, 18, 2
_SHIFTS = 6
# Delays that are tried where any up to a farthest one is looked for.
_TRIED = 401
# Rates of a clock that are looked for, each within this relative error; all but the first are of known mistakes, up to
# the relative error of a fit.
_RATES, _PACE, _FIT = (1.0, 0.5, 2.0, 0.25, 4.0), 0.25, 1e-3
WORLD = "world"
_PERMUTATIONS = [
    (order, signs)
    for order in itertools.permutations(range(3))
    for signs in itertools.product((1.0, -1.0), repeat=3)
    if order != (0, 1, 2) or len(set(signs)) > 1
]
# Part of the difference that an arbitrary factor or limit may leave: as it is fitted, few samples agree by chance.
_EXACT = 1e-3
# A jump in an otherwise constant curve fits any time shift. So a shift is looked for only if at least _SEEN samples
# differ, each by the part _FEW of the largest difference.
_SEEN, _FEW = 6, 1e-2
# Tolerance with which a delay counts as half a step, in steps.
_HALF = 0.1
# Differences up to this many error bars of the truth are ignored.
_BARS = 10.0
# Entries of a matrix below this part of its largest one count as zero.
_SHARE = 1e-9
_SIGN = "an engine may give the vector on the other body: look at the body it acts on"


@dataclass(frozen=True)
class ReportedVector:
    """A vector that an engine reports at each time.

    Attributes:
        name: of the variable, e.g. ``w_WB``.
        what: description, e.g. ``the angular velocity``.
        unit: its unit.
        reported, true: reported and true values, shape (time, …, 3); NaN where the equations do not determine them.
        time: [s], shape (time,).
        frames: name -> rotations whose columns are the frame's axes in the world, shape (time, …, 3, 3).
        least: size below which the quantity stands still, in its unit.
        bar: error bar of the truth, in its unit.
    """

    name: str
    what: str
    unit: str
    reported: FloatArray
    true: FloatArray
    time: FloatArray
    frames: Mapping[str, FloatArray] = field(default_factory=dict)
    least: float = 0.0
    bar: float = 0.0

    @property
    def size(self) -> float:
        """Largest true component, at least :attr:`least`."""
        return max(float(np.nanmax(np.abs(self.true), initial=0.0)), self.least)

    @property
    def differs(self) -> bool:
        """True if the report differs by more than round-off and the error bar of the truth."""
        comparable = self.reported.shape == self.true.shape and above_round_off(self.before, self.size)
        return comparable and self.before > _BARS * self.bar

    def after_start(self) -> ReportedVector:
        """The vector without time 0 if it is right there: an engine may report its initial values unchanged."""
        reported, true = self.reported, self.true
        if (
            len(reported) < 2
            or reported.shape != true.shape
            or above_round_off(known_difference(reported[0], true[0]), self.size)
        ):
            return self
        frames = {key: frame[1:] for key, frame in self.frames.items()}
        return replace(self, reported=reported[1:], true=true[1:], time=self.time[1:], frames=frames)

    @property
    def before(self) -> float:
        """Largest difference between report and truth."""
        return known_difference(self.reported, self.true)

    def cause(
        self,
        kind: str,
        says: str,
        explained: FloatArray,
        remedy: str,
        number: int = 0,
        closes: float = CLOSES,
        explains: int | None = None,
        change: float = np.inf,
    ) -> Cause:
        """Cause: the engine reports ``explained`` instead of the truth.

        Values without a determined truth are left out.
        """
        partly = np.any(np.isnan(self.true), axis=-1, keepdims=True)
        aside = partly & (np.isnan(explained) | np.isnan(self.reported))
        reported, true, explained = (
            np.where(aside, np.nan, values) for values in (self.reported, self.true, explained)
        )
        difference, remainder = known_difference(reported, true), known_difference(reported, explained)
        if difference < self.before / 2:
            remainder = np.inf  # most of the difference is in what is left aside
        off = Difference(self.name, self.unit, difference, closes=closes)
        return off.cause(f"{kind}.{self.name}", says, remainder, remedy, number, explains=explains, change=change)

    def causes(self, step: float | None) -> Iterator[Cause]:
        """All causes of this module, the simple ones first; none if nothing differs.

        Args:
            step: of the engine [s], or None.
        """
        if not self.differs:
            return
        sign = self.cause("sign", f"{self.name} has the wrong sign: it is minus {self.what}", -self.true, _SIGN)
        for causes in (
            iter([sign]),
            self._scaled(step),
            self._frames(),
            self._clamped(),
            self._late(step),
            self._axes(),
        ):
            tried = list(causes)
            yield from tried
            if any(cause.proven and cause.left <= _EXACT for cause in tried):
                return  # a simple mistake that leaves nothing is enough

    def _frames(self) -> Iterator[Cause]:
        remedy = f"give {self.name} along the axes of the world"
        for name, frame in self.frames.items():
            local = components_along(frame, self.true)
            yield self.cause("frame", f"{self.name} looks like {self.what} in {name}", local, remedy)
            yield self.cause("frame", f"{self.name} looks like minus {self.what} in {name}", -local, remedy)
            turned = product(frame, self.true)
            yield self.cause("frame", f"{self.name} looks turned by {name} once too often", turned, remedy)

    def _axes(self) -> Iterator[Cause]:
        for name, frame in {WORLD: None, **self.frames}.items():
            local = self.true if frame is None else components_along(frame, self.true)
            reported = self.reported if frame is None else components_along(frame, self.reported)
            for order, signs in _PERMUTATIONS:
                permuted = local[..., order] * signs
                if known_difference(reported, permuted) * 4 > self.before:
                    continue
                frame_words = "" if frame is None else f" in {name}"
                shown = ", ".join("-" * (s < 0) + "xyz"[k] for k, s in zip(order, signs, strict=True))
                says = f"{self.name} has other axes or signs{frame_words}: its x, y, z are the true {shown}"
                explained = permuted if frame is None else product(frame, permuted)
                yield self.cause("axes", says, explained, f"look at the signs and the order of axes of {self.name}")

    def _scaled(self, step: float | None) -> Iterator[Cause]:
        square = float(np.nansum(self.true**2))
        if not square:
            return
        factor = float(np.nansum(self.reported * self.true)) / square
        impulse = bool(step) and abs(factor - (step or 0.0)) < 1e-3 * (step or 0.0)
        usual = impulse or known_factor(factor) is not None
        times = "times the step, as an impulse" if impulse else factor_text(factor)
        says = f"{self.name} is {self.what} {times}"
        remedy = f"look at the unit of {self.name}"
        if usual:
            yield self.cause("scaled", says, factor * self.true, remedy)
        else:  # some factor takes any number to any other
            sizes = np.abs(self.true[np.abs(self.true) > _EXACT * self.size])
            explains, change = _distinct(sizes, self.size), change_by(factor)
            yield self.cause("scaled", says, factor * self.true, remedy, 1, _EXACT, explains, change)

    def _clamped(self) -> Iterator[Cause]:
        """Causes: each component, or the length of the vector, is limited to a constant."""
        limit = float(np.nanmax(np.abs(self.reported), initial=0.0))
        sizes = np.linalg.norm(np.nan_to_num(self.true), axis=-1, keepdims=True)
        longest = float(np.max(np.linalg.norm(np.nan_to_num(self.reported), axis=-1)))
        shorter = self.true * np.minimum(1.0, longest / np.where(sizes > 0, sizes, 1.0))
        magnitudes = np.abs(self.true)
        for what, where_limited, largest, explained, true in (
            (f"each component of {self.name}", "", limit, np.clip(self.true, -limit, limit), magnitudes),
            (self.name, "a length of ", longest, shorter, sizes),
        ):
            remedy = f"find what limits {self.name} to {largest:.6g} {self.unit}"
            says = f"{what} is clamped at {where_limited}{largest:.6g} {self.unit}"
            above = true[true > largest] - largest
            most = float(np.max(above, initial=0.0))
            change = most / (largest + most) if most else np.inf
            yield self.cause("clamped", says, explained, remedy, 1, _EXACT, _distinct(above, most), change)

    def _late(self, step: float | None) -> Iterator[Cause]:
        off = np.max(np.nan_to_num(np.abs(self.reported - self.true)).reshape(len(self.time), -1), axis=-1)
        differs = np.count_nonzero(off > _FEW * self.before) >= _SEEN
        shift = best_delay(self.time, self.reported, self.true) if differs else None
        # a sample on the other side of a jump differs alone, which any curve through the jump explains by a delay
        if shift is None or np.sort(off)[-2] <= 2 * shift[2]:
            return
        delay, difference, remainder = shift
        # a method of first order, x + h v, is late by half a step without any mistake
        half_step = self.unit == "m" and bool(step) and abs(abs(delay) / (step or 1.0) - 0.5) < _HALF
        says = f"{self.name} is {delay_text(delay, step)}"
        remedy = f"sample {self.name} at the time that was asked for"
        change = 0.0 if half_step else in_steps(delay, step)
        off_by_time = Difference(self.name, self.unit, difference)
        yield off_by_time.cause(f"late.{self.name}", says, remainder, remedy, 1, change=change)


def components_along(frame: FloatArray, vectors: FloatArray) -> FloatArray:
    """Components of vectors along the axes of frames; NaN if they depend on a NaN."""
    return product(np.swapaxes(frame, -1, -2), vectors)


def product(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Products of matrices and vectors; NaN where a NaN component contributes."""
    unknown = np.isnan(vectors)
    size = float(np.max(np.abs(matrices), initial=0.0))
    products = np.einsum("...ij,...j->...i", matrices, np.where(unknown, 0.0, vectors))
    lost = np.einsum("...ij,...j->...i", np.abs(matrices) > _SHARE * size, unknown.astype(float)) > 0
    return np.where(lost, np.nan, products)


def _distinct(values: FloatArray, size: float) -> int:
    """Count of distinct values, at a resolution of :data:`_EXACT` times ``size``."""
    if not values.size or not size:
        return 0
    return 1 + int(np.sum(np.diff(np.sort(values, axis=None)) > _EXACT * size))


def _comparable(time: FloatArray, reported: FloatArray, true: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Components of both arrays that are finite in all samples, each of shape (time, components).

    None if there are too few samples or no such component.
    """
    if len(time) < _FEWEST:
        return None
    flat, exact = reported.reshape(len(time), -1), true.reshape(len(time), -1)
    finite = np.isfinite(flat).all(0) & np.isfinite(exact).all(0)
    return (flat[:, finite], exact[:, finite]) if finite.any() else None


def best_delay(
    time: FloatArray, reported: FloatArray, true: FloatArray, farthest: float | None = None
) -> tuple[float, float, float] | None:
    """Delay of the reported values [s], and the largest difference before and after correction.

    Args:
        time: of the samples [s], shape (time,).
        reported: values of the run, shape (time, …).
        true: values of the truth at the same times.
        farthest: longest delay that is looked for [s]; before time 0 the motion then stands at its start. By default
            the time of the first samples, which are left out.

    Returns:
        None if there are too few samples.
    """
    from scipy.interpolate import make_interp_spline

    comparable = _comparable(time, reported, true)
    if comparable is None:
        return None
    flat, exact = comparable
    end = _SPLINE if len(time) >= _MANY else _END
    inner = slice(end, -end)
    flat, curve = flat[inner], make_interp_spline(time, exact, k=_SPLINE)
    rate, reach = curve.derivative(), float(time[end] - time[0])

    def left(delay: float) -> FloatArray:
        moments = time[inner] - delay
        valid_mask = (moments <= time[-1]) & ((moments >= time[0]) | (time[0] == 0))
        return np.where(valid_mask[:, None], flat - curve(np.clip(moments, time[0], time[-1])), np.nan)

    begin = 0.0
    if farthest is not None:
        tried = np.linspace(-farthest, farthest, _TRIED)
        begin, reach = float(min(tried, key=lambda delay: float(np.nanmean(left(delay) ** 2)))), farthest
    delay = begin
    for _ in range(_SHIFTS):
        moments = time[inner] - delay
        slope = rate(np.clip(moments, time[0], time[-1])) * ((time[0] <= moments) & (moments <= time[-1]))[:, None]
        square = float(np.sum(slope**2))
        if not square:
            return None
        delay -= float(np.nansum(left(delay) * slope)) / square
        delay = float(np.clip(delay, -reach, reach))
    return delay, known_difference(flat, exact[inner]), float(np.nanmax(np.abs(left(delay))))


def best_clock_factor(time: FloatArray, reported: FloatArray, true: FloatArray) -> tuple[float, float, float] | None:
    """Factor of the engine's clock, and the largest difference before and after correction.

    None if there are too few samples.
    """
    from scipy.interpolate import make_interp_spline

    comparable = _comparable(time, reported, true)
    if comparable is None:
        return None
    since = time - time[0]
    curve, fits = make_interp_spline(since, comparable[1], k=_SPLINE), list[tuple[float, float, float]]()
    for rate in _RATES:
        inner = since <= since[-1] / max(1.0, rate * (1 + _PACE))  # where the truth is known at the clock's time
        if np.sum(inner) < _FEWEST and rate != 1:
            continue
        flat, known = comparable[0][inner], comparable[1][inner]

        def left(faster: float, since: FloatArray = rate * since[inner], flat: FloatArray = flat) -> FloatArray:
            return np.asarray(flat - curve(since * (1 + float(np.clip(faster, -_PACE, _PACE))))).ravel()

        faster = float(np.clip(least_squares_parameter(left, 0.0, 1.0), -_PACE, _PACE))
        difference = float(np.max(np.abs(flat - known)))
        fits.append((rate * (1 + faster), difference, float(np.max(np.abs(left(faster))))))
    return min(fits, key=lambda fit: fit[2] / (fit[1] or 1.0))


def mistaken_rate(rate: float) -> bool:
    """True if the rate of a clock [1] is that of a known mistake: half, twice, a quarter, four times."""
    return any(abs(rate - mistake) <= _FIT * mistake for mistake in _RATES[1:])


def in_steps(delay: float, step: float | None) -> float:
    """Size of a time shift in steps; infinite if there is no step."""
    return abs(delay) / step if step else np.inf


def delay_text(delay: float, step: float | None) -> str:
    """Text of a time shift; in steps if it is half a step, one or two."""
    word = "late" if delay > 0 else "early"
    if step:
        steps = abs(delay) / step
        for number, words in ((0.5, "half a step"), (1.0, "one step"), (2.0, "two steps")):
            if abs(steps - number) <= 0.05 * number:
                return f"{words} ({abs(delay):.3g} s) {word}"
    return f"{abs(delay):.3g} s {word}"
