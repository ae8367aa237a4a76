"""What can happen to a vector on its way from an engine into a sample: sign, unit, axes, frame, time, precision.

Every test takes the true vectors, does to them what the engine may have done, and holds the result against what the
engine said. So it needs no equations, and is proof by itself.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES, Cause, above_round_off, apart
from proofroll.core.diagnosis.clocks import late, said_delay
from proofroll.core.diagnosis.fitting import known_factor, said_factor

WORLD = "world"
# A rotation is fitted with three numbers, a scale or a shift with one, a limit with one.
_PERMUTATIONS = [
    (order, signs)
    for order in itertools.permutations(range(3))
    for signs in itertools.product((1.0, -1.0), repeat=3)
    if order != (0, 1, 2) or len(set(signs)) > 1
]
# A unit is exact: a factor that nobody makes by mistake has to leave less, or few samples of anything would be alike.
_EXACT = 1e-3
# A step in an otherwise constant curve fits any shift: that a time is another shows where the curve changes, at this
# many samples at least, each by this part of the largest difference.
_SEEN, _FEW = 6, 1e-2
_SIGN = "an engine may give what acts on the other body: look at whose vector it is"


@dataclass(frozen=True)
class Reported:
    """A vector that an engine gives at each time.

    Attributes:
        name: of the variable, e.g. ``w_WB``.
        what: in words, e.g. ``the angular velocity``.
        unit: its unit.
        said, true: values, shape (time, …, 3).
        time: [s], shape (time,).
        frames: name -> rotations whose columns are the frame's axes in the world, shape (time, …, 3, 3).
        least: size below which the quantity stands still, in its unit.
    """

    name: str
    what: str
    unit: str
    said: FloatArray
    true: FloatArray
    time: FloatArray
    frames: Mapping[str, FloatArray] = field(default_factory=dict)
    least: float = 0.0

    def after_start(self) -> Reported:
        """Without time 0 where that is right: an engine may give there what it was given."""
        said, true = self.said, self.true
        size = max(float(np.max(np.abs(true), initial=0.0)), self.least)
        if len(said) < 2 or said.shape != true.shape or above_round_off(apart(said[0], true[0]), size):
            return self
        frames = {key: frame[1:] for key, frame in self.frames.items()}
        return replace(self, said=said[1:], true=true[1:], time=self.time[1:], frames=frames)

    @property
    def before(self) -> float:
        """Largest difference."""
        return apart(self.said, self.true)

    def cause(
        self, kind: str, says: str, explained: FloatArray, remedy: str, number: int = 0, closes: float = CLOSES
    ) -> Cause:
        """That the engine said ``explained`` instead of the truth."""
        proof = self.name, self.unit, self.before, apart(self.said, explained)
        return Cause(f"{kind}.{self.name}", says, *proof, remedy, number, closes=closes)

    def causes(self, step: float | None) -> Iterator[Cause]:
        """All of this module, as far as there is a difference."""
        size = float(np.max(np.abs(self.true), initial=self.least))
        if self.said.shape != self.true.shape or not above_round_off(self.before, size):
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
            if any(cause.proven for cause in tried):
                return  # what is simple goes first, and is enough

    def _frames(self) -> Iterator[Cause]:
        remedy = f"give {self.name} along the axes of the world"
        for name, frame in self.frames.items():
            local = into(frame, self.true)
            yield self.cause("frame", f"{self.name} looks like {self.what} in {name}", local, remedy)
            yield self.cause("frame", f"{self.name} looks like minus {self.what} in {name}", -local, remedy)
            turned = np.einsum("...ij,...j->...i", frame, self.true)
            yield self.cause("frame", f"{self.name} looks turned by {name} once too often", turned, remedy)

    def _axes(self) -> Iterator[Cause]:
        for name, frame in {WORLD: None, **self.frames}.items():
            local = self.true if frame is None else into(frame, self.true)
            said = self.said if frame is None else into(frame, self.said)
            for order, signs in _PERMUTATIONS:
                changed = local[..., order] * signs
                if apart(said, changed) * 4 > self.before:
                    continue
                where = "" if frame is None else f" in {name}"
                shown = ", ".join("-" * (s < 0) + "xyz"[k] for k, s in zip(order, signs, strict=True))
                says = f"{self.name} has other axes or signs{where}: its x, y, z are the true {shown}"
                explained = changed if frame is None else np.einsum("...ij,...j->...i", frame, changed)
                yield self.cause("axes", says, explained, f"look at the signs and the order of axes of {self.name}")

    def _scaled(self, step: float | None) -> Iterator[Cause]:
        square = float(np.sum(self.true**2))
        if not square:
            return
        factor = float(np.sum(self.said * self.true)) / square
        impulse = bool(step) and abs(factor - (step or 0.0)) < 1e-3 * (step or 0.0)
        known = impulse or known_factor(factor) is not None
        if np.count_nonzero(self.true) < 2 and not known:
            return  # some factor takes any number to any other
        times = "times the step, as an impulse" if impulse else said_factor(factor)
        says = f"{self.name} is {self.what} {times}"
        closes = CLOSES if known else _EXACT
        yield self.cause("scaled", says, factor * self.true, f"look at the unit of {self.name}", 1, closes)

    def _clamped(self) -> Iterator[Cause]:
        """A limit is held exactly, as a unit is."""
        limit = float(np.max(np.abs(self.said)))
        sizes = np.linalg.norm(self.true, axis=-1, keepdims=True)
        longest = float(np.max(np.linalg.norm(self.said, axis=-1)))
        shorter = self.true * np.minimum(1.0, longest / np.where(sizes > 0, sizes, 1.0))
        for what, at, largest, explained in (
            (f"each component of {self.name}", "", limit, np.clip(self.true, -limit, limit)),
            (self.name, "a length of ", longest, shorter),
        ):
            remedy = f"find what limits {self.name} to {largest:.6g} {self.unit}"
            says = f"{what} is clamped at {at}{largest:.6g} {self.unit}"
            yield self.cause("clamped", says, explained, remedy, 1, _EXACT)

    def _late(self, step: float | None) -> Iterator[Cause]:
        differs = np.max(np.abs(self.said - self.true).reshape(len(self.time), -1), axis=-1) > _FEW * self.before
        shift = late(self.time, self.said, self.true) if np.count_nonzero(differs) >= _SEEN else None
        if shift is None:
            return
        delay, before, after = shift
        says = f"{self.name} is {said_delay(delay, step)}"
        remedy = f"sample {self.name} at the time that was asked for"
        yield Cause(f"late.{self.name}", says, self.name, self.unit, before, after, remedy, 1)


def into(frame: FloatArray, vectors: FloatArray) -> FloatArray:
    """Components along the axes of frames."""
    return np.asarray(np.einsum("...ji,...j->...i", frame, vectors))
