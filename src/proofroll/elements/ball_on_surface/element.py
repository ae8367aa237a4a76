"""A ball on a surface as an element of a scene: its data, and what the harness calls."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.bounds import DENSEST, LIGHTEST
from proofroll.core.columns import Columns
from proofroll.core.element import FirstMotion, OptionalTerm, Sign, StepNumber
from proofroll.core.errors import InputError, Refused
from proofroll.core.gravity import Gravity
from proofroll.core.number_format import vector
from proofroll.core.observable import Observable
from proofroll.core.program_text import FailedRun
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface import certificate, failure, natural_scales
from proofroll.elements.ball_on_surface.dataset import from_samples
from proofroll.elements.ball_on_surface.failure_program import program
from proofroll.elements.ball_on_surface.mechanics import initial_response, natural_acceleration, normal_force
from proofroll.elements.ball_on_surface.model import BallCapability, RollingBall
from proofroll.elements.ball_on_surface.of_body import ball_of
from proofroll.elements.ball_on_surface.optional_terms import optional_terms
from proofroll.elements.ball_on_surface.sampling import BallSample
from proofroll.elements.ball_on_surface.surfaces import Cylinder
from proofroll.elements.mechanism.run.contacts import local_frame
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.core.certificate import Line

# Relative angle between gravity and the axis of a cylinder that is round-off.
_ROUND_OFF = 1e-12


@dataclass(frozen=True)
class BallOnSurface:
    """A ball that rolls without slip in an upright cylinder (Blajer 2006). See :class:`.Element`.

    Attributes:
        ball, surface, contact, start, gravity: data of the scene.
    """

    ball: Ball
    surface: Cylinder
    contact: Contact
    start: InitialMotion
    gravity: Gravity

    sample_type: ClassVar[type[BallSample]] = BallSample

    def __post_init__(self) -> None:
        """Checks that the ball rolls on a wall at rest, where the wall has a normal.

        Raises:
            InputError: the ball may slip, flies or bounces, or its wall is no cylinder at rest along gravity.
        """
        if not rolls_evenly(self.surface, self.contact, self.start, self.gravity.vector):
            advice = "its own mechanics follows a ball that rolls; read this one as a body (ball_as_body)"
            raise InputError("start", self.start, advice)
        if not np.all(np.isfinite([self.rolling.p0, self.rolling.v0, self.rolling.w0])):
            advice = "the surface has no normal there, as at an apex; start elsewhere"
            raise InputError("coordinates", list(self.start.coordinates), advice)

    @property
    def name(self) -> str:
        """Name of the ball."""
        return self.ball.name

    @property
    def bodies(self) -> tuple[str, ...]:
        """The ball."""
        return (self.ball.name,)

    @cached_property
    def requires(self) -> frozenset[str]:
        """See the protocol."""
        resists = {BallCapability.ROLLING_RESISTANCE} if self.contact.rolling_resistance > 0 else set()
        return frozenset({BallCapability.ROLLING} | resists)

    optional: ClassVar[frozenset[str]] = frozenset({BallCapability.ROLLING_RESISTANCE, BallCapability.ORIENTATION})
    askable: ClassVar[Mapping[str, str]] = {"orientation": BallCapability.ORIENTATION}
    softened: ClassVar[frozenset[str]] = frozenset(name for name in certificate.CAPS if not name.startswith("1 / "))
    failures: ClassVar[Mapping[str, str]] = failure.MEANINGS
    failing_events: ClassVar[Mapping[str, str]] = {}

    @property
    def start_facts(self) -> Sequence[str]:
        """Sentences on centre, velocity and normal force."""
        body = self.rolling
        named = zip(body.wall.coordinates, body.u0.tolist(), body.wall.units, strict=True)
        place = ", ".join(f"{name} = {value:.4g}{'' if unit == '1' else f' {unit}'}" for name, value, unit in named)
        sentences = [
            f"{body.ball.name}: centre at {vector(body.p0)} m in the world ({place}), velocity {vector(body.v0)} m/s, "
            f"spin {vector(body.w0)} rad/s"
        ]
        press = float(normal_force(body, body.p0, initial_response(body)[1]))
        moves = "it rolls" if np.any(body.v0) else "its centre is at rest"
        return [*sentences, f"{moves}; the {body.wall.kind} presses it with {press:.4g} N"]

    @property
    def implausible(self) -> Sequence[str]:
        """See :class:`proofroll.core.element_abilities.DoubtsNumbers`; osmium is the densest material."""
        ball = self.ball
        density = ball.mass / (4 / 3 * math.pi * ball.radius**3)
        if LIGHTEST <= density <= DENSEST:
            return []
        what = f"{ball.mass:.4g} kg in a radius of {ball.radius:.4g} m are {density:.2g} kg/m³"
        than = "denser than osmium" if density > DENSEST else "less than any solid"
        return [f"ball {ball.name}: {what}, {than}; lengths are metres, masses kg"]

    @cached_property
    def rolling(self) -> RollingBall:
        """Ball on its surface in the form that engines use."""
        surface = self.surface.offset(self.ball.radius)
        u0 = np.asarray(self.start.coordinates, dtype=np.float64)
        frame = surface.frame(u0)
        v0 = frame[:, 1:] @ np.asarray(self.start.velocity)
        w0 = self.start.spin * frame[:, 0] - np.cross(frame[:, 0], v0) / self.ball.radius
        return RollingBall(
            ball=self.ball,
            contact=self.contact,
            surface=surface,
            wall=self.surface,
            gravity=self.gravity.vector,
            u0=u0,
            p0=surface.position(u0),
            v0=v0,
            w0=w0,
        )

    @cached_property
    def observables(self) -> tuple[Observable, ...]:
        """See the protocol."""
        body = self.rolling
        return local_frame.table(body, natural_acceleration(body), body.surface.length_scales)

    @property
    def length(self) -> float:
        """The radius [m]."""
        return self.ball.radius

    @property
    def natural_time(self) -> float:
        """See the protocol."""
        return natural_scales.natural_time(self.rolling)

    @property
    def turn_interval(self) -> float | None:
        """See :class:`proofroll.core.element_abilities.CountsTurns`."""
        return natural_scales.turn_interval(self.rolling)

    def step_numbers(self, h: float, truth: xr.Dataset | None) -> Sequence[StepNumber]:
        """See the protocol."""
        return natural_scales.step_numbers(self.rolling, h, truth)

    @cached_property
    def first_motion(self) -> FirstMotion:
        """See the protocol."""
        return natural_scales.first_motion(self.rolling)

    def another_scene(self, lines: Sequence[Mapping[str, Any]], truth: xr.Dataset) -> str | None:
        """See :class:`proofroll.core.element_abilities.KnowsAnotherScene`."""
        friction = truth["needed_friction"].to_numpy()
        return certificate.another_scene(lines, float(np.max(friction[np.isfinite(friction)], initial=0.0)))

    def variables(self, times: FloatArray, samples: Sequence[BallSample]) -> Columns:
        """See the protocol; the variables are those of :func:`proofroll.elements.ball_on_surface.dataset.columns`."""
        return from_samples(self.rolling, times, samples)

    def lacks(self, samples: Sequence[BallSample], asks: Sequence[str]) -> str | None:
        """See the protocol."""
        if "orientation" in asks and any(sample.q_WB is None for sample in samples):
            return "the engine does not give the ball's orientation"
        return None

    def observe(self, dataset: xr.Dataset) -> dict[str, FloatArray]:
        """See the protocol."""
        return local_frame.observe(self.rolling, dataset)

    def scales(self, truth: xr.Dataset) -> dict[str, float]:
        """See the protocol."""
        return local_frame.scales(self.rolling, truth)

    def certify(self, built: Any, sample: BallSample) -> list[Line]:
        """See the protocol."""
        return certificate.certify(self.rolling, built, sample)

    def signs(self, dataset: xr.Dataset, truth: xr.Dataset | None) -> list[Sign]:
        """See the protocol."""
        return failure.signs(self.rolling, dataset, truth)

    def cause(self, dataset: xr.Dataset, error: float) -> str | None:
        """See :class:`proofroll.core.element_abilities.ExplainsErrors`."""
        return failure.cause(self.rolling, dataset, error)

    def failure_program(self, failed: FailedRun, engine: str | None) -> str:
        """See :class:`proofroll.core.element_abilities.WritesPrograms`."""
        return program(self.rolling, failed, engine)

    def optional_terms(self, parameters: Mapping[str, float], truth: xr.Dataset) -> list[OptionalTerm]:  # noqa: ARG002 -- the protocol's
        """See the protocol: rolling resistance and orientation."""
        return optional_terms(self, parameters)


def rolls_evenly(surface: object, contact: Contact, start: InitialMotion, gravity: FloatArray) -> bool:
    """True if a ball rolls in a cylinder at rest whose axis is along gravity, and never slips or bounces."""
    rolls = not start.gap and start.tangential_spin is None and contact.restitution is None
    rolls = rolls and math.isinf(contact.mu_static)
    if not (rolls and isinstance(surface, Cylinder)):
        return False
    axis, pull = np.asarray(surface.generators[1].axis), float(np.linalg.norm(gravity))
    return bool(np.linalg.norm(np.cross(gravity, axis)) <= _ROUND_OFF * pull)


def rolling_ball(scene: Scene) -> RollingBall:
    """Ball of a scene with one ball in an upright cylinder. Raises Refused if the scene has another element."""
    (element,) = scene.elements if len(scene.elements) == 1 else (None,)
    ball = element.rolling if isinstance(element, BallOnSurface) else None if element is None else ball_of(element)
    if ball is None:
        what = ", ".join(item.name for item in scene.elements)
        raise Refused(f"represents one ball in an upright cylinder, and the scene holds {what}")
    return ball


def scene_with(scene: Scene, **parts: Any) -> Scene:
    """Copy of a scene with another ``ball``, ``surface``, ``contact``, ``start`` or ``gravity``."""
    (element,) = scene.elements
    assert isinstance(element, BallOnSurface)
    return dataclasses.replace(scene, elements=(dataclasses.replace(element, **parts),))
