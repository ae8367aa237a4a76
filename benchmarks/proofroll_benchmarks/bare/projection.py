"""The projection method without the adapter: the engine's own equations in a plain loop.

The method is proofroll's; a loop with equations of its own would compare two implementations. The ratio is what the
adapter adds to the equations: the choice of steps, and the checks after each of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.integrate import DOP853

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.core.integrators import INTEGRATORS
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.dynamics.switches import switched_joints
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.elements.mechanism.scene.signal import varies
from proofroll.engines.projection.contact.contact_modes import ContactMotion
from proofroll.engines.projection.smooth.dependent import DependentCoordinates
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.projection.geometry import Uniform
from proofroll.papers.blajer_2006.projection.method import ProjectedBall, start_and_scales
from proofroll.papers.blajer_2006.projection.orientation import EulerAngles, Orientation, RotatingFrame
from proofroll_benchmarks.bare import Bare, in_vertical_cylinder
from proofroll_benchmarks.bare.steps import dop853, rk4


def prepare(scene: Scene, settings: Any) -> Bare:
    """See :mod:`proofroll_benchmarks.bare`."""
    if settings.formulation not in {"euler", "rotating_frame"}:
        return _bodies(scene, settings)
    return Bare(_ball(in_vertical_cylinder(scene), settings), 1e-9, "angles are not brought back within a turn")


def _ball(body: RollingBall, settings: Any) -> Callable[[FloatArray], FloatArray]:
    orientation: Orientation = EulerAngles() if settings.formulation == "euler" else RotatingFrame()
    ball = ProjectedBall(body, Uniform(body.surface), orientation)
    start, scales = start_and_scales(body, orientation)

    def after(x: FloatArray) -> FloatArray:
        return ball.eliminated(x) if settings.eliminates else x

    def accepted(solver: DOP853, _: float) -> None:
        solver.y = after(solver.y)
        solver.f = ball.rates(solver.y)

    def controlled(times: FloatArray) -> FloatArray:
        solver = DOP853(lambda _, x: ball.rates(x), 0.0, start, np.inf, rtol=settings.rtol, atol=settings.rtol * scales)
        dop853(solver, times, accepted)
        return np.asarray(solver.y)

    def run(times: FloatArray) -> FloatArray:
        by_error = settings.integrator == "dop853"
        x = controlled(times) if by_error else rk4(ball.rates, start, times, settings.dt, after)
        return np.asarray(body.surface.position(x[:2]))

    return run


def _bodies(scene: Scene, settings: Any) -> Bare:
    """The bodies of a mechanism, cut apart, by the integrators that the engine has, or its modes of contacts.

    Raises:
        Refused: the mechanism has joints that switch, or signals that change in time.
    """
    mechanism = mechanism_of(scene)
    equations = DependentCoordinates(mechanism)
    if switched_joints(mechanism) or any(map(varies, mechanism.signals)):
        raise Refused("there is no bare loop with joints that switch or signals that change in time")
    resolution = float(getattr(settings, settings.resolution))
    stepper = INTEGRATORS[settings.integrator](resolution)

    def accepted(t: float, x: FloatArray, held: Sequence[int] = ()) -> FloatArray:
        equations.applied.now = t
        if settings.eliminates:
            x = equations.eliminated(x, held) if held else equations.eliminated(x)
        equations.accept(x)
        return x

    motion: Any = stepper
    if mechanism.contacts:
        step, tolerance = (resolution, 0.0) if settings.resolution == "dt" else (0.0, resolution)
        motion = ContactMotion(equations, mechanism, stepper, accepted, step, tolerance)
    else:
        stepper.begin(0.0, equations.start, equations.rates, accepted, np.ones(len(equations.start)))

    def run(times: FloatArray) -> FloatArray:
        for t in times[1:].tolist():
            motion.advance(t)
        x = motion.x
        bodies = equations.bodies(x)
        return np.asarray(equations.parts(x)[0] - np.einsum("nij,nj->ni", bodies.rotation, equations.com))

    return Bare(run, 1e-12, "the steps are the same")
