"""Balls of another inertia, mass, gravity or resistance than the scene's."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.mechanics import newton_euler
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallSample
from proofroll_drill.mutants.base import STEP, Honest, Mutant
from proofroll_drill.placed_balls import gravity_of, placed, scene_with

RESISTED = ("sphere_in_cylinder", {"rolling_resistance": 5e-4})


def _ball(scene: Scene, **numbers: Any) -> Scene:
    return scene_with(scene, ball=dataclasses.replace(placed(scene).ball, **numbers))


def _contact(scene: Scene, **numbers: Any) -> Scene:
    return scene_with(scene, contact=dataclasses.replace(placed(scene).contact, **numbers))


def _gravity(scene: Scene, **numbers: Any) -> Scene:
    return scene_with(scene, gravity=dataclasses.replace(gravity_of(scene), **numbers))


class ThinShell(Mutant):
    """J = 2/3 m a²."""

    fault = "inertia of a thin shell, 2/3 m a^2"
    named = ("moment of inertia",)

    def misread(self, scene: Scene) -> Scene:
        """Hollow."""
        return _ball(scene, inertia_ratio=2 / 3)


class InertiaTwice(Mutant):
    """The inertia is added to what the engine already has."""

    fault = "inertia counted twice"
    named = ("moment of inertia",)

    def misread(self, scene: Scene) -> Scene:
        """Twice."""
        return _ball(scene, inertia_ratio=0.8)


class ToldInertia(Honest):
    """The same, and its certificate says so."""

    fault = "inertia counted twice, and read back"
    named = ("inertia counted twice",)

    def misread(self, scene: Scene) -> Scene:
        """Twice."""
        return _ball(scene, inertia_ratio=0.8)


class GravityHalved(Mutant):
    """Half of the potential."""

    fault = "gravity halved"
    named = ("gravity",)

    def misread(self, scene: Scene) -> Scene:
        """Half."""
        return _gravity(scene, magnitude=0.5 * gravity_of(scene).magnitude)


class GravityUp(Mutant):
    """g = +9.81."""

    fault = "gravity with the wrong sign"
    named = ("gravity",)

    def misread(self, scene: Scene) -> Scene:
        """Up."""
        return _gravity(scene, direction=(0, 0, 1))


class MassTwice(Mutant):
    """The path is right, the forces are not."""

    fault = "mass counted twice"
    named = ("mass",)

    def misread(self, scene: Scene) -> Scene:
        """Twice, with the inertia per mass of the scene."""
        return _ball(scene, mass=2 * placed(scene).ball.mass)


class Unresisted(Mutant):
    """f is read and forgotten."""

    fault = "rolling resistance ignored"
    scene = RESISTED
    named = ("rolling resistance",)

    def misread(self, scene: Scene) -> Scene:
        """None."""
        return _contact(scene, rolling_resistance=0.0)


class ResistanceInMillimetres(Mutant):
    """f taken for millimetres."""

    fault = "rolling resistance in the wrong unit"
    scene = RESISTED
    named = ("rolling resistance",)

    def misread(self, scene: Scene) -> Scene:
        """A thousandth."""
        return _contact(scene, rolling_resistance=5e-7)


class NewtonMutant(Mutant):
    """Runge-Kutta 4 on the unreduced equations, with a fault in them.

    Attributes:
        h: length of a step that it counts as one [s].
    """

    h: ClassVar[float] = STEP

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.body = rolling_ball(scene)
        self.x = np.stack([self.body.p0, self.body.v0, self.body.w0])

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


class GravityAlongY(NewtonMutant):
    """The engine's up is y."""

    fault = "gravity along y"
    named = ("gravity is",)

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        g = float(np.linalg.norm(self.body.gravity))
        self.body = dataclasses.replace(self.body, gravity=np.array([0.0, -g, 0.0]))


class Damped(NewtonMutant):
    """Velocity and spin shrink at each step, as engines for games have it by default."""

    fault = "damping of 0.04 per second left on"
    named = ("damped",)

    def after_step(self, x: FloatArray) -> FloatArray:
        """Shrunk."""
        return np.stack([x[0], *(x[1:] * (1 - 0.04 * STEP))])


class AgainstSpin(NewtonMutant):
    """The resistance opposes ω as a whole."""

    fault = "rolling resistance against the spin"
    scene = RESISTED
    named = ("against the whole angular velocity",)

    def response(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The part along the wall as f of another size, the part about the normal besides."""
        p, _, w = x
        e1, J, f = self.body.surface.normal(p), self.body.ball.inertia, self.body.contact.rolling_resistance
        about, size = float(w @ e1), float(np.linalg.norm(w))
        less = _of(self.body, f * float(np.sqrt(max(size**2 - about**2, 0.0))) / size)
        acceleration, alpha, force = newton_euler(less, *x)
        return acceleration, alpha - f * (-force @ e1) * about / size / J * e1, force


def _of(body: RollingBall, f: float) -> RollingBall:
    return dataclasses.replace(body, contact=dataclasses.replace(body.contact, rolling_resistance=f))
