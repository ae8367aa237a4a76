"""Balls of another model, start, contact or clock than the scene's."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.mechanics import newton_euler
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallSample
from proofroll_drill.mutants.base import STEP, Honest, Mutant, OneStepBehind, planted
from proofroll_drill.placed_balls import gravity_of, placed, scene_with

RESISTED = ("sphere_in_cylinder", {"rolling_resistance": 5e-4})


def _ball(**numbers: Any) -> Callable[[Any, Scene], Scene]:
    """Misreading of a scene: other numbers of its ball."""
    return lambda _, scene: scene_with(scene, ball=dataclasses.replace(placed(scene).ball, **numbers))


def _resistance(value: float) -> Callable[[Any, Scene], Scene]:
    """Misreading of a scene: another arm of rolling resistance [m]."""

    def misread(_: Any, scene: Scene) -> Scene:
        contact = dataclasses.replace(placed(scene).contact, rolling_resistance=value)
        return scene_with(scene, contact=contact)

    return misread


def _gravity(factor: float) -> Callable[[Any, Scene], Scene]:
    """Misreading of a scene: its gravity times a factor."""

    def misread(_: Any, scene: Scene) -> Scene:
        true = gravity_of(scene)
        direction = tuple(np.sign(factor) * np.array(true.direction))
        return scene_with(
            scene, gravity=dataclasses.replace(true, magnitude=abs(factor) * true.magnitude, direction=direction)
        )

    return misread


def _twice_the_mass(_: Any, scene: Scene) -> Scene:
    """Misreading of a scene: the path is right, for the inertia per mass is, and the forces are not."""
    ball = placed(scene).ball
    return scene_with(scene, ball=dataclasses.replace(ball, mass=2 * ball.mass))


class ToldInertia(Honest):
    """The inertia is added to what the engine already has, and its certificate says so."""

    fault = "inertia counted twice, and read back"
    named = ("inertia counted twice",)

    def misread(self, scene: Scene) -> Scene:
        """Twice."""
        return _ball(inertia_ratio=0.8)(self, scene)


class NewtonMutant(Mutant):
    """Runge-Kutta 4 on the unreduced equations, with a fault in them.

    Attributes:
        h: length of a step that it counts as one [s].
    """

    h: ClassVar[float] = STEP

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.body = self.moved(rolling_ball(scene))
        self.x = self.started(np.stack([self.body.p0, self.body.v0, self.body.w0]))

    def moved(self, body: RollingBall) -> RollingBall:
        """Ball that it moves."""
        return body

    def started(self, x: FloatArray) -> FloatArray:
        """State from which it starts."""
        return x

    def response(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Accelerations and force at a state."""
        return newton_euler(self.body, *x)

    def rates(self, x: FloatArray) -> FloatArray:
        """Rates of the state."""
        a, alpha, _ = self.response(x)
        return np.stack([x[1], a, alpha])

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        h = self.h
        for _ in range(round((t - self.t) / STEP)):
            k1 = self.rates(self.x)
            k2 = self.rates(self.x + h / 2 * k1)
            k3 = self.rates(self.x + h / 2 * k2)
            k4 = self.rates(self.x + h * k3)
            self.x = self.after_step(self.x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        self.t = t

    def after_step(self, x: FloatArray) -> FloatArray:
        """State after the engine's changes between steps."""
        return x

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        p, v, w = self.x
        return BallSample(p.copy(), v.copy(), w.copy(), force=self.response(self.x)[2])

    def events(self) -> list[Any]:
        """None."""
        return []

    def built(self) -> Any:
        """Model as given; its start follows its own equations."""
        a, alpha, _ = self.response(self.x)
        return dataclasses.replace(self.claimed.built(), acceleration=a, angular_acceleration=alpha)


def _resisted(body: RollingBall, f: float) -> RollingBall:
    return dataclasses.replace(body, contact=dataclasses.replace(body.contact, rolling_resistance=f))


def _gravity_along_y(_: Any, body: RollingBall) -> RollingBall:
    """Ball of an engine whose up is y."""
    return dataclasses.replace(body, gravity=np.array([0.0, -float(np.linalg.norm(body.gravity)), 0.0]))


def _against_spin(self: Any, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Response with the part of the moment along the wall as f of another size, the part about the normal besides."""
    p, _, w = x
    e1, J, f = self.body.surface.normal(p), self.body.ball.inertia, self.body.contact.rolling_resistance
    about, size = float(w @ e1), float(np.linalg.norm(w))
    less = _resisted(self.body, f * float(np.sqrt(max(size**2 - about**2, 0.0))) / size)
    acceleration, alpha, force = newton_euler(less, *x)
    return acceleration, alpha - f * (-force @ e1) * about / size / J * e1, force


def _resisted_by_weight(self: Any, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Response with the f that gives the moment f m g, whatever the wall presses."""
    arm, weight = self.body.contact.rolling_resistance, self.body.ball.mass * float(np.linalg.norm(self.body.gravity))
    f = arm
    for _ in range(20):
        N = -float(newton_euler(_resisted(self.body, f), *x)[2] @ self.body.surface.normal(x[0]))
        f = arm * weight / N
    return newton_euler(_resisted(self.body, f), *x)


def _mean_force(self: Any, sample: BallSample) -> BallSample:
    """Sample with the mean force over a step, by the trapezoidal rule."""
    return dataclasses.replace(sample, force=(self.behind.sample().force + sample.force) / 2)


_misread, _newton = partial(planted, Mutant), partial(planted, NewtonMutant)
FAULTS = (
    _misread(
        "ThinShell", "inertia of a thin shell, 2/3 m a^2", "all inertias 5/3 times", misread=_ball(inertia_ratio=2 / 3)
    ),
    _misread("InertiaTwice", "inertia counted twice", "all inertias counted twice", misread=_ball(inertia_ratio=0.8)),
    ToldInertia,
    _misread("GravityHalved", "gravity halved", "gravity", misread=_gravity(0.5)),
    _misread("GravityUp", "gravity with the wrong sign", "gravity", misread=_gravity(-1.0)),
    _misread("MassTwice", "mass counted twice", "mass", misread=_twice_the_mass),
    _misread(
        "Unresisted", "rolling resistance ignored", "rolling resistance", scene=RESISTED, misread=_resistance(0.0)
    ),
    _misread(
        "ResistanceInMillimetres",
        "rolling resistance in the wrong unit",
        "rolling resistance",
        scene=RESISTED,
        misread=_resistance(5e-7),
    ),
    _newton("GravityAlongY", "gravity along y", "gravity is", moved=_gravity_along_y),
    # as engines for games have it by default
    _newton(
        "Damped",
        "damping of 0.04 per second left on",
        "damped",
        after_step=lambda _, x: np.stack([x[0], *(x[1:] * (1 - 0.04 * STEP))]),
    ),
    _newton(
        "AgainstSpin",
        "rolling resistance against the spin",
        "against the whole angular velocity",
        scene=RESISTED,
        response=_against_spin,
    ),
    _newton(
        "NoSpin",
        "initial spin forgotten",
        ("angular velocity left out", "spin left out"),
        started=lambda _, x: np.stack([*x[:2], np.zeros(3)]),
    ),
    _newton(
        "ResistedByWeight",
        "rolling resistance by the weight instead of N",
        "weight",
        scene=RESISTED,
        response=_resisted_by_weight,
    ),
    planted(OneStepBehind, "MeanForce", "force averaged over the last step", "half a step", misreport=_mean_force),
    _newton("FastClock", "time that runs 4 % too fast", "time", h=1 / 480),
)
