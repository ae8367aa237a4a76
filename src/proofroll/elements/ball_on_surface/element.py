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
from proofroll.core.element_abilities import RunWatch
from proofroll.core.errors import InputError, Refused
from proofroll.core.events import EventKind
from proofroll.core.gravity import Gravity
from proofroll.core.number_format import vector
from proofroll.core.observable import Observable
from proofroll.core.program_text import FailedRun
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface import certificate, events, failure, natural_scales
from proofroll.elements.ball_on_surface.dataset import from_samples
from proofroll.elements.ball_on_surface.failure_program import program
from proofroll.elements.ball_on_surface.mechanics import initial_response, natural_acceleration, normal_force
from proofroll.elements.ball_on_surface.model import BallCapability, RollingBall
from proofroll.elements.ball_on_surface.optional_terms import optional_terms
from proofroll.elements.ball_on_surface.sampling import BallSample
from proofroll.elements.ball_on_surface.surfaces import Cylinder, Plane, Surface
from proofroll.elements.mechanism.run.contacts import local_frame
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.core.certificate import Line


@dataclass(frozen=True)
class BallOnSurface:
    """A ball that rolls on a plane or in a cylinder, and slips where friction gives way. See :class:`.Element`.

    Attributes:
        ball, surface, contact, start, gravity: data of the scene.
    """

    ball: Ball
    surface: Surface
    contact: Contact
    start: InitialMotion
    gravity: Gravity

    sample_type: ClassVar[type[BallSample]] = BallSample

    def __post_init__(self) -> None:
        """Checks that the ball rolls on a wall at rest, where the wall has a normal.

        Raises:
            InputError: the ball flies, slips or bounces, its wall turns, or its start has no normal.
        """
        if not rolls_evenly(self.surface, self.contact, self.start):
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
        needs = {BallCapability.ROLLING}
        if self.contact.rolling_resistance > 0:
            needs.add(BallCapability.ROLLING_RESISTANCE)
        if math.isfinite(self.contact.mu_static):
            needs.add(BallCapability.BOUNDED_FRICTION)
        if any(generator.kind == "rotation" for generator in self.surface.generators):
            needs.add(BallCapability.CURVED_SURFACE)
        return frozenset(needs)

    optional: ClassVar[frozenset[str]] = frozenset(
        {BallCapability.ROLLING_RESISTANCE, BallCapability.BOUNDED_FRICTION, BallCapability.ORIENTATION}
    )
    askable: ClassVar[Mapping[str, str]] = {"orientation": BallCapability.ORIENTATION}
    softened: ClassVar[frozenset[str]] = frozenset(name for name in certificate.CAPS if not name.startswith("1 / "))
    failures: ClassVar[Mapping[str, str]] = failure.MEANINGS
    failing_events: ClassVar[Mapping[str, str]] = {EventKind.LIFT_OFF: failure.LEFT}

    @property
    def start_facts(self) -> Sequence[str]:
        """Sentences on centre, velocity, normal force, and whether the ball rolls, rests or leaves at once."""
        body = self.rolling
        named = zip(body.wall.coordinates, body.u0.tolist(), body.wall.units, strict=True)
        place = ", ".join(f"{name} = {value:.4g}{'' if unit == '1' else f' {unit}'}" for name, value, unit in named)
        sentences = [
            f"{body.ball.name}: centre at {vector(body.p0)} m in the world ({place}), velocity {vector(body.v0)} m/s, "
            f"spin {vector(body.w0)} rad/s"
        ]
        _, force = initial_response(body)
        press = float(normal_force(body, body.p0, force))
        if not np.any(force):
            return [*sentences, f"it leaves the {body.wall.kind} at once: nothing presses it on"]
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
    def first_motion(self) -> FirstMotion | None:
        """See the protocol; None for a ball at rest under rolling resistance, which has no direction yet."""
        return natural_scales.first_motion(self.rolling)

    def another_scene(self, lines: Sequence[Mapping[str, Any]], truth: xr.Dataset) -> str | None:
        """See :class:`proofroll.core.element_abilities.KnowsAnotherScene`."""
        friction = truth["needed_friction"].to_numpy()
        return certificate.another_scene(lines, float(np.max(friction[np.isfinite(friction)], initial=0.0)))

    def variables(self, times: FloatArray, samples: Sequence[BallSample]) -> Columns:
        """See the protocol; the variables are those of :func:`proofroll.elements.ball_on_surface.dataset.columns`."""
        return from_samples(self.rolling, times, samples)

    def watch(self, asks: Sequence[str]) -> RunWatch:  # noqa: ARG002 -- the protocol's
        """See :class:`proofroll.core.element_abilities.WatchesRuns`."""
        return events.Watch(self.rolling)

    def common_span(
        self, truth: xr.Dataset, runs: Mapping[Any, xr.Dataset]
    ) -> tuple[xr.Dataset, dict[Any, xr.Dataset]]:
        """See :class:`proofroll.core.element_abilities.WatchesRuns`."""
        return events.common_span(truth, runs)

    def lacks(self, samples: Sequence[BallSample], asks: Sequence[str]) -> str | None:
        """See the protocol."""
        if BallCapability.BOUNDED_FRICTION in self.requires and any(sample.sticking is None for sample in samples):
            return "the engine does not say whether the ball sticks or slips"
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

    def optional_terms(self, parameters: Mapping[str, float], truth: xr.Dataset) -> list[OptionalTerm]:
        """See the protocol: rolling resistance, bounded friction and orientation."""
        return optional_terms(self, parameters, truth)


def rolls_evenly(surface: object, contact: Contact, start: InitialMotion) -> bool:
    """True if a ball rolls on a plane or in a cylinder at rest, and never bounces."""
    rolls = not start.gap and start.tangential_spin is None and contact.restitution is None
    return rolls and isinstance(surface, Plane | Cylinder) and not getattr(surface, "turning", 0.0)


def rolling_ball(scene: Scene) -> RollingBall:
    """Ball of a scene with one ball on one surface. Raises Refused if the scene has another element."""
    (element,) = scene.elements if len(scene.elements) == 1 else (None,)
    from proofroll.elements.ball_on_surface.as_body import ball_of
    from proofroll.elements.mechanism.run.element import MechanismElement
    if isinstance(element, MechanismElement):
        return ball_of(element)
    if not isinstance(element, BallOnSurface):
        what = ", ".join(item.name for item in scene.elements)
        raise Refused(f"represents one ball on one surface, and the scene holds {what}")
    return element.rolling


def scene_with(scene: Scene, **parts: Any) -> Scene:
    """Copy of a scene with another ``ball``, ``surface``, ``contact``, ``start`` or ``gravity``."""
    (element,) = scene.elements
    assert isinstance(element, BallOnSurface)
    return dataclasses.replace(scene, elements=(dataclasses.replace(element, **parts),))
