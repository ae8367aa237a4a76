"""Balls of another inertia, mass, gravity, resistance or friction than the scene's."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import rolling_ball, scene_with
from proofroll.elements.ball_on_surface.mechanics import newton_euler
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallSample
from proofroll.elements.mechanism.run.contacts.on_wall import slip_velocity
from proofroll_drill.mutants.base import STEP, Honest, Mutant

RESISTED = ("sphere_in_cylinder", {"rolling_resistance": 5e-4})
SLIPPING = ("sphere_in_cylinder", {"mu_static": 0.2, "mu_kinetic": 0.15})


def _ball(scene: Scene, **numbers: float) -> Scene:
    return scene_with(scene, ball=dataclasses.replace(scene.elements[0].ball, **numbers))  # type: ignore[attr-defined]


def _contact(scene: Scene, **numbers: float) -> Scene:
    return scene_with(scene, contact=dataclasses.replace(scene.elements[0].contact, **numbers))  # type: ignore[attr-defined]


def _gravity(scene: Scene, factor: float, direction: tuple[float, float, float] = (0, 0, -1)) -> Scene:
    gravity = scene.elements[0].gravity  # type: ignore[attr-defined]
    return scene_with(
        scene, gravity=dataclasses.replace(gravity, magnitude=factor * gravity.magnitude, direction=direction)
    )


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
        return _gravity(scene, 0.5)


class GravityUp(Mutant):
    """g = +9.81."""

    fault = "gravity with the wrong sign"
    named = ("gravity",)

    def misread(self, scene: Scene) -> Scene:
        """Up."""
        return _gravity(scene, 1.0, (0, 0, 1))


class GravityAlongY(Mutant):
    """The engine's up is y."""

    fault = "gravity along y"
    named = ("gravity is",)

    def misread(self, scene: Scene) -> Scene:
        """Along -y."""
        return _gravity(scene, 1.0, (0, -1, 0))


class MassTwice(Mutant):
    """The path is right, the forces are not."""

    fault = "mass counted twice"
    named = ("mass",)

    def misread(self, scene: Scene) -> Scene:
        """Twice, with the inertia per mass of the scene."""
        return _ball(scene, mass=2 * scene.elements[0].ball.mass)  # type: ignore[attr-defined]


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


class KineticForStatic(Mutant):
    """One coefficient for both."""

    fault = "kinetic friction taken for the static one"
    scene = SLIPPING
    until, every = 0.45, 0.006
    named = ("kinetic friction",)

    def misread(self, scene: Scene) -> Scene:
        """0.15 for 0.2."""
        return _contact(scene, mu_static=0.15)


class StaticForKinetic(Mutant):
    """The other way round."""

    fault = "static friction taken for the kinetic one"
    scene = SLIPPING
    until, every = 0.45, 0.006
    named = ("kinetic friction",)

    def misread(self, scene: Scene) -> Scene:
        """0.2 for 0.15."""
        return _contact(scene, mu_kinetic=0.2)


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


class Pyramid(Mutant):
    """Once it slips the friction is that of a pyramid whose axes lie 30 degrees off e2 and e3."""

    fault = "pyramidal friction cone"
    scene: ClassVar[Any] = SLIPPING
    until, every = 0.45, 0.006
    named = ("pyramid",)

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.body = rolling_ball(scene)
        self.x: FloatArray | None = None

    def friction(self, x: FloatArray, N: float, slip: FloatArray, tangents: FloatArray) -> FloatArray:  # noqa: ARG002 -- of the next
        """Friction on the ball."""
        c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
        turn = np.array([[c, -s], [s, c]])
        along = turn.T @ (tangents.T @ slip)
        return np.asarray(
            -self.body.contact.mu_kinetic * N * tangents @ turn @ (np.sign(along) * (abs(along) == max(abs(along))))
        )

    def slipping(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rates of the state, and the force."""
        p, v, w = x
        body, m = self.body, self.body.ball.mass
        frame = body.surface.frame(body.surface.locate(p[None]))[0]
        e1 = frame[:, 0]
        N = m * float(body.gravity @ e1 + body.surface.normal_gradient(p) @ v @ v)
        slip = slip_velocity(body.ball.radius, e1, v, w)
        force = self.friction(x, N, slip, frame[:, 1:]) - N * e1
        alpha = body.ball.radius * np.cross(e1, force) / body.ball.inertia
        return np.stack([v, force / m + body.gravity, alpha]), force

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        if self.x is None:
            self.inner.advance(t)
            seen = self.inner.sample()
            if not seen.sticking:
                self.x = np.stack([seen.p_WB, seen.v_WB, seen.w_WB])
        else:
            for _ in range(round((t - self.t) / STEP)):
                k1 = self.slipping(self.x)[0]
                k2 = self.slipping(self.x + STEP / 2 * k1)[0]
                k3 = self.slipping(self.x + STEP / 2 * k2)[0]
                k4 = self.slipping(self.x + STEP * k3)[0]
                self.x = self.x + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        self.t = t

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        if self.x is None:
            seen: BallSample = self.inner.sample()
            return dataclasses.replace(seen, q_WB=None)
        p, v, w = self.x
        return BallSample(p.copy(), v.copy(), w.copy(), force=self.slipping(self.x)[1], sticking=False)


class AgainstVelocity(Pyramid):
    """The friction opposes the centre's velocity."""

    fault = "friction against the velocity of the centre"
    named = ("velocity of the centre",)

    def friction(self, x: FloatArray, N: float, slip: FloatArray, tangents: FloatArray) -> FloatArray:  # noqa: ARG002 -- as above
        """Along -v."""
        return np.asarray(-self.body.contact.mu_kinetic * N * x[1] / np.linalg.norm(x[1]))
