"""Hypotheses that a number of the scene is another in the engine, or that a load acts which the scene has not."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.diagnosis import Cause, Evidence
from proofroll.core.diagnosis.fitting import known_factor, said_factor, telling
from proofroll.elements.ball_on_surface.diagnosis.equations import Law, has_resistance, held_against, is_bounded
from proofroll.elements.ball_on_surface.model import RollingBall


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
            if not telling(factor):
                continue
            says = f"the engine moves a ball with {self.what} {self._said(factor, scene)}"
            yield held.cause(self.id, says, self._law(body, factor * scene), self.remedy, 1)

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
                yield held.cause(self.id, self.says.format(value=value), self.law(body, value), self.remedy, 1)


def _damps_velocity(body: RollingBall, c: float) -> Law:
    return Law(body, force=lambda v: -c * body.ball.mass * v)


def _damps_spin(body: RollingBall, c: float) -> Law:
    return Law(body, moment=lambda _e1, _v, w: -c * body.ball.inertia * w)


def _damps_both(body: RollingBall, c: float) -> Law:
    return Law(body, force=lambda v: -c * body.ball.mass * v, moment=lambda _e1, _v, w: -c * body.ball.inertia * w)


_DAMPING = "find the engine's own damping, drag or sleeping, and switch it off"
NUMBERS: tuple[Any, ...] = (
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
        only=has_resistance,
    ),
    Number(
        "kinetic friction",
        "a kinetic friction",
        lambda body: body.contact.mu_kinetic,
        _friction,
        "while it slips the friction is the kinetic coefficient times N",
        lambda x: x >= 0,
        only=is_bounded,
    ),
    Load("damping", "the velocity is damped at a rate of {value:.4g} per second", _damps_velocity, _DAMPING),
    Load("damping", "the spin is damped at a rate of {value:.4g} per second", _damps_spin, _DAMPING),
    Load("damping", "velocity and spin are damped at a rate of {value:.4g} per second", _damps_both, _DAMPING),
)
