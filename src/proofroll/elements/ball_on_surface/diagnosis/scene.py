"""Hypotheses that an engine moves another ball, or by another law, whatever its certificate says.

Each is held against the certificate, if that differs, and against the equations at the run's own states.
"""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES, CLOSES_EXACTLY, Cause, Evidence
from proofroll.core.diagnosis.fitting import fitted, known_factor, said_factor
from proofroll.core.diagnosis.lines import differing, left
from proofroll.core.diagnosis.vectors import apart
from proofroll.core.events import events_of
from proofroll.elements.ball_on_surface.diagnosis.equations import Law, residuals, response, states
from proofroll.elements.ball_on_surface.model import RollingBall

# The true run's own residuals are the measurement's: a difference below so many of them says nothing.
_ABOVE = 20.0
_ANGLES = 90
_FEWEST = 5
# Along one direction every cone has its edge or its face: the slip has to turn by this much to tell [rad].
# A face that is fitted comes near any short arc of slip: an elliptic cone that lags left a fiftieth.
_PYRAMID = 1 / 100
_TURNS = 0.4
# What an engine is given, and may say to hold though it does not.
GIVEN = ("mass", "inertia", "gravity", "ball radius", "rolling resistance", "static friction", "kinetic friction")
# What follows from the law by which a ball moves.
COVERED = ("force", "p_WB", "v_WB", "w_WB", "velocity", "spin", "acceleration", "angular acceleration")


@dataclass(frozen=True)
class Held:
    """What laws are held against: a certificate, or the states of a run.

    Attributes:
        left: what a law leaves; infinite for None.
        quantity, unit: of what it leaves.
        before: largest that the scene's own law leaves.
        closes: part of it that a proof may leave.
    """

    left: Callable[[Law | None], FloatArray]
    quantity: str
    unit: str
    before: float
    closes: float

    def largest(self, law: Law | None) -> float:
        """What a law leaves at most."""
        return float(np.max(np.abs(self.left(law))))

    def fit(self, law: Callable[[float], Law | None], start: float) -> float:
        """The number of a law that leaves least."""
        return fitted(lambda x: self.left(law(x)), start, 1.0)

    def cause(self, name: str, says: str, law: Law | None, remedy: str, number: int) -> Iterator[Cause]:
        """That the engine moves by this law."""
        after = self.largest(law)
        yield Cause(name, says, self.quantity, self.unit, self.before, after, remedy, number, COVERED, self.closes)


def held_against(evidence: Evidence) -> Iterator[Held]:
    """The certificate, if something in it differs; the run, unless the equations hold there as for the truth."""
    body = evidence.element.rolling
    wrong = differing(evidence.lines)
    if wrong and float(np.linalg.norm(body.v0)) > 0:

        def left_of_lines(law: Law | None) -> FloatArray:
            plain = left(evidence.lines, {}, GIVEN)
            return np.full_like(plain, np.inf) if law is None else left(evidence.lines, at_start(body, law), GIVEN)

        what = " and ".join(str(line["quantity"]) for line in wrong[:2]) + (" and more" if len(wrong) > 2 else "")
        before = float(np.max(np.abs(left(evidence.lines, {}, GIVEN)), initial=0.0))
        yield Held(left_of_lines, f"at time 0 {what}, relative,", "1", before, CLOSES_EXACTLY)
    if evidence.run is None or evidence.truth is None:
        return
    seen, true = states(body, evidence.run), states(body, evidence.truth)
    if seen is None or true is None:
        return

    def left_of_run(law: Law | None) -> FloatArray:
        found = residuals(body, seen, law or Law(body))
        return np.full_like(found, np.inf) if law is None else found

    plain = Law(body)
    before = float(np.max(np.abs(residuals(body, seen, plain))))
    if np.isfinite(before) and before > _ABOVE * float(np.max(np.abs(residuals(body, true, plain)))):
        yield Held(left_of_run, "motion", "m/s^2", before, CLOSES)


def at_start(body: RollingBall, law: Law) -> dict[str, Any]:
    """What a certificate would expect of a ball that moves by a law."""
    acceleration, turning, force = response(law, body.p0, body.v0, body.w0, True)
    local = body.surface.frame(body.u0).T @ force
    ball, contact = law.body.ball, law.body.contact
    return {
        "mass": [ball.mass],
        "inertia": [ball.inertia] * 3,
        "gravity": law.body.gravity,
        "rolling resistance": [contact.rolling_resistance],
        "static friction": [contact.mu_static],
        "kinetic friction": [contact.mu_kinetic],
        "acceleration": acceleration,
        "angular acceleration": turning,
        "N": [-local[0]],
        "F2": [local[1]],
        "F3": [local[2]],
    }


def _falling(body: RollingBall, gravity: FloatArray) -> Law:
    return Law(dataclasses.replace(body, gravity=gravity))


def _contact(body: RollingBall, **changes: float) -> RollingBall:
    return dataclasses.replace(body, contact=dataclasses.replace(body.contact, **changes))  # type: ignore[arg-type]  # numbers by name


def _ball(body: RollingBall, **changes: float) -> RollingBall:
    return dataclasses.replace(body, ball=dataclasses.replace(body.ball, **changes))  # type: ignore[arg-type]  # likewise


def _resisting(body: RollingBall, f: float) -> RollingBall:
    """With any f, also one that no contact has: an engine may drive the ball by it."""
    contact = copy.copy(body.contact)
    object.__setattr__(contact, "rolling_resistance", f)
    return dataclasses.replace(body, contact=contact)


def _friction(body: RollingBall, mu: float) -> RollingBall:
    return _contact(body, mu_kinetic=mu, mu_static=max(mu, body.contact.mu_static))


@dataclass(frozen=True)
class Number:
    """A number of the scene is another one in the engine.

    Attributes:
        id: of the hypothesis.
        what: the number, in words.
        value: of the scene; None or 0: the scene has none of it.
        change: the ball with another value.
        remedy: what to look at.
        possible: whether there can be such a value.
        only: whether the scene has it.
    """

    id: str
    what: str
    value: Callable[[RollingBall], float]
    change: Callable[[RollingBall, float], RollingBall]
    remedy: str
    possible: Callable[[float], bool] = lambda _: True
    only: Callable[[RollingBall], bool] = lambda _: True
    grounds: str = "one factor on this number of the scene closes accelerations and forces at every sample"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        body = evidence.element.rolling
        scene = self.value(body)
        if not scene or not np.isfinite(scene) or not self.only(body):
            return
        for held in held_against(evidence):
            factor = _snapped(held.fit(lambda x: self._law(body, x * scene), 1.0))
            says = f"the engine moves a ball with {self.what} {self._said(factor, scene)}"
            yield from held.cause(self.id, says, self._law(body, factor * scene), self.remedy, 1)

    def _law(self, body: RollingBall, value: float) -> Law | None:
        return Law(self.change(body, value)) if self.possible(value) else None

    @staticmethod
    def _said(factor: float, scene: float) -> str:
        return f"{said_factor(factor)} ({factor * scene:.6g} instead of {scene:.6g})"


def _snapped(factor: float) -> float:
    known = known_factor(factor)
    return known[0] if known else factor


@dataclass(frozen=True)
class Load:
    """A force or a moment that the scene does not have, with one coefficient.

    Attributes:
        id: of the hypothesis.
        says: with the coefficient as ``{value}``.
        law: of the ball and the coefficient.
        remedy: what to look at.
    """

    id: str
    says: str
    law: Callable[[RollingBall, float], Law]
    remedy: str
    grounds: str = "the load with one coefficient closes accelerations and forces at every sample"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        body = evidence.element.rolling
        for held in held_against(evidence):
            value = held.fit(lambda x: self.law(body, x), 0.0)
            if value > 0:
                yield from held.cause(self.id, self.says.format(value=value), self.law(body, value), self.remedy, 1)


@dataclass(frozen=True)
class OtherLaw:
    """A law of the contact that is another than the scene's, without a number to fit.

    Attributes:
        id: of the hypothesis.
        says: what the engine does.
        laws: possible ones for a ball, with how many numbers were chosen for each.
        remedy: what to look at.
        applies: whether the scene has what the law is about.
    """

    id: str
    says: str
    laws: Callable[[RollingBall], Iterator[Law]]
    remedy: str
    applies: Callable[[RollingBall], bool]
    fitted: int = 0
    grounds: str = "the other law gives the accelerations and forces at every sample, with no number or one angle"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        body = evidence.element.rolling
        if not self.applies(body):
            return
        for held in held_against(evidence):
            best = min(self.laws(body), key=held.largest)
            yield from held.cause(self.id, self.says, best, self.remedy, self.fitted)


@dataclass(frozen=True)
class AnyGravity:
    """Gravity points another way."""

    id: str = "direction of gravity"
    grounds: str = "accelerations are linear in gravity: one vector closes them at every sample"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        body = evidence.element.rolling
        for held in held_against(evidence):
            at = held.left(_falling(body, body.gravity))
            slopes = np.stack([held.left(_falling(body, body.gravity + axis)) - at for axis in np.eye(3)], axis=-1)
            gravity = body.gravity - np.linalg.lstsq(slopes, at, rcond=None)[0]
            shown = np.where(np.abs(gravity) < 1e-6 * np.max(np.abs(gravity)), 0.0, gravity)
            says = f"the engine's gravity is ({', '.join(f'{x:.4g}' for x in shown)}) m/s^2"
            yield from held.cause(self.id, says, _falling(body, gravity), "look at the axes of gravity", 3)


@dataclass(frozen=True)
class StartsToSlip:
    """The bound of sticking is another than the scene's."""

    id: str = "static friction"
    grounds: str = "up to the first slip the path is the true one, so the friction that it needs then is the bound"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        run, truth, contact = evidence.run, evidence.truth, evidence.element.contact
        if run is None or truth is None or not np.isfinite(contact.mu_static) or "sticking" not in truth:
            return
        first, true = (
            next((event.time for event in events_of(data) if event.kind == "slip"), float(data["time"][-1]))
            for data in (run, truth)
        )
        if contact.mu_kinetic >= contact.mu_static or first == true:
            return
        time, needed = truth["time"].to_numpy(), truth["needed_friction"].to_numpy()
        held = (time <= true) & (truth["sticking"].to_numpy() > 0) & np.isfinite(needed)
        above = np.flatnonzero(held & (needed >= contact.mu_kinetic))
        if not len(above) or above[0] == 0:
            return
        i = int(above[0])
        share = (contact.mu_kinetic - needed[i - 1]) / (needed[i] - needed[i - 1])
        crossing = float(time[i - 1] + share * (time[i] - time[i - 1]))
        both = f"the kinetic friction {contact.mu_kinetic:g}, not at the static {contact.mu_static:g}"
        says = f"the ball begins to slip at {both}"
        remedy = "the ball sticks up to the static friction, and only slips at the kinetic one"
        yield Cause(
            self.id, says, "first slip", "s", abs(first - true), abs(first - crossing), remedy, 0, ("motion", "force")
        )


@dataclass(frozen=True)
class PyramidalCone:
    """Friction depends on the direction of the slip."""

    id: str = "pyramidal cone"
    grounds: str = (
        "while it slips, the reported friction is that of a cone of four faces at one angle, sample by sample"
    )

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        run, body = evidence.run, evidence.element.rolling
        if run is None or "sticking" not in run or "N" not in run or not _is_bounded(body):
            return
        slips = run["sticking"].to_numpy() == 0
        slip = np.stack([run[name].to_numpy()[slips] for name in ("slip2", "slip3")], axis=-1)
        said = np.stack([run[name].to_numpy()[slips] for name in ("F2", "F3")], axis=-1)
        most = body.contact.mu_kinetic * run["N"].to_numpy()[slips][:, None]
        sizes = np.linalg.norm(slip, axis=-1, keepdims=True)
        if len(slip) < _FEWEST or not np.all(sizes > 0) or not np.all(np.isfinite(said)):
            return
        directions = np.unwrap(np.arctan2(slip[:, 1], slip[:, 0]))
        if np.ptp(directions) < _TURNS:
            return
        before = apart(said, -most * slip / sizes)
        after = np.inf
        for angle in np.arange(_ANGLES) * np.pi / 2 / _ANGLES:
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            along = slip @ turn
            corner = np.abs(along) == np.max(np.abs(along), axis=-1, keepdims=True)
            for kind in (corner, 1.0):
                after = min(after, apart(said, -most * (np.sign(along) * kind) @ turn.T))
        says = "the friction cone is a pyramid: the friction depends on the direction of the slip"
        remedy = "choose an elliptic (quadratic) cone"
        covered = ("motion", *COVERED)
        yield Cause(self.id, says, "friction while slipping", "N", before, after, remedy, 1, covered, closes=_PYRAMID)


def _has_resistance(body: RollingBall) -> bool:
    return body.contact.rolling_resistance > 0


def _is_bounded(body: RollingBall) -> bool:
    return bool(np.isfinite(body.contact.mu_static))


def _along_spin(body: RollingBall) -> Iterator[Law]:
    def moment(ball: RollingBall, N: float, w: FloatArray) -> FloatArray:
        return -ball.contact.rolling_resistance * N * w / (float(np.linalg.norm(w)) or 1.0)

    yield Law(body, resisting=moment)


def _as_velocity(body: RollingBall) -> Iterator[Law]:
    def friction(ball: RollingBall, N: float, v: FloatArray) -> FloatArray:
        return -ball.contact.mu_kinetic * N * v / (float(np.linalg.norm(v)) or 1.0)

    yield Law(body, slipping=friction)


def _damps_velocity(body: RollingBall, c: float) -> Law:
    return Law(body, force=lambda v: -c * body.ball.mass * v)


def _damps_spin(body: RollingBall, c: float) -> Law:
    return Law(body, moment=lambda w: -c * body.ball.inertia * w)


def _damps_both(body: RollingBall, c: float) -> Law:
    return Law(body, force=lambda v: -c * body.ball.mass * v, moment=lambda w: -c * body.ball.inertia * w)


_DAMPING = "find the engine's own damping, drag or sleeping, and switch it off"
LAWS: tuple[Any, ...] = (
    Number(
        "inertia",
        "a moment of inertia (J over m a^2)",
        lambda body: body.ball.inertia_ratio,
        lambda body, x: _ball(body, inertia_ratio=x),
        "give the engine the scene's inertia, about the centre, once",
        lambda x: x > 0,
    ),
    Number(
        "mass",
        "a mass",
        lambda body: body.ball.mass,
        lambda body, x: _ball(body, mass=x),
        "give the engine the scene's mass, once",
        lambda x: x > 0,
    ),
    Number(
        "gravity",
        "gravity",
        lambda body: float(np.linalg.norm(body.gravity)),
        lambda body, x: dataclasses.replace(body, gravity=body.gravity * (x / float(np.linalg.norm(body.gravity)))),
        "give the engine the scene's gravity: an acceleration in the world, its sign and its unit",
    ),
    Number(
        "rolling resistance",
        "a rolling resistance f",
        lambda body: body.contact.rolling_resistance,
        _resisting,
        "the moment is f N against the rolling, f a length in metres",
        only=_has_resistance,
    ),
    Number(
        "kinetic friction",
        "a kinetic friction",
        lambda body: body.contact.mu_kinetic,
        _friction,
        "while it slips the friction is the kinetic coefficient times N",
        lambda x: x >= 0,
        only=_is_bounded,
    ),
    Load("damping", "the velocity is damped at a rate of {value:.4g} per second", _damps_velocity, _DAMPING),
    Load("damping", "the spin is damped at a rate of {value:.4g} per second", _damps_spin, _DAMPING),
    Load("damping", "velocity and spin are damped at a rate of {value:.4g} per second", _damps_both, _DAMPING),
    OtherLaw(
        "resistance along spin",
        "the rolling resistance acts against the whole angular velocity, spin about the normal included",
        _along_spin,
        "the moment of the rolling resistance is f (v/V) x (-N e1): it is against the rolling alone",
        _has_resistance,
    ),
    OtherLaw(
        "friction against velocity",
        "the friction acts against the velocity of the centre, not against the slip of the contact point",
        _as_velocity,
        "friction is against v + w x a e1",
        _is_bounded,
    ),
    PyramidalCone(),
    AnyGravity(),
    StartsToSlip(),
)
