"""Exudyn without the adapter: one call of its solver over the whole horizon, with sensors that keep the samples.

The items and their consistent start come from the adapter's builders, since a user would add the same ones; all user
functions that run while Exudyn integrates are written here, for the vertical cylinder.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.engines.exudyn.integration import simulation_settings
from proofroll.engines.exudyn.native import Output, exu, items
from proofroll.engines.exudyn.smooth.redundant import Redundant
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.exudyn.carrier import Carrier
from proofroll.papers.blajer_2006.exudyn.rolling_disc import RollingDisc
from proofroll_benchmarks.bare import Bare, in_vertical_cylinder

Start = tuple[FloatArray, FloatArray]


def prepare(scene: Scene, settings: Any) -> Bare:
    """See :mod:`proofroll_benchmarks.bare`."""
    restarted = "Newton's method is restarted at every sample, and ends within its tolerance"
    loops = {"carrier": _carrier, "rolling_disc": _rolling_disc}
    if settings.formulation not in loops:
        return Bare(_mechanism(scene, settings), 1e-7, restarted)
    return Bare(loops[settings.formulation](in_vertical_cylinder(scene), settings), 1e-9, restarted)


def _solve(
    system: Any,
    settings: Any,
    times: FloatArray,
    start: Start | None = None,
    *,
    dependent: bool = False,
) -> None:
    """Exudyn's solver over the whole time, without its stopwatches."""
    options = simulation_settings(settings, dependent=dependent)
    time = options.timeIntegration
    time.numberOfSteps, time.endTime = round(float(times[-1]) / settings.dt), float(times[-1])
    options.solution.sensors.active = True
    options.solution.sensors.writePeriod = float(times[1])
    time.generalizedAlpha.computeInitialAccelerations = start is None
    solver = exu.MainSolverImplicitSecondOrder()
    if start is not None:
        system.systemData.SetODE2Coordinates_tt(start[0], exu.ConfigurationType.Initial)
    solver.InitializeSolver(system, options)
    timer = solver.timer
    timer.useTimer = False
    solver.timer = timer
    if start is not None:
        system.systemData.SetAECoordinates(start[1], exu.ConfigurationType.Current)
    if not solver.SolveSteps(system, options):
        raise Diverged("Exudyn's solver failed")


def _sensors(system: Any, node: Any, forces: Sequence[tuple[Any, Any]], state: Sequence[Any]) -> None:
    """State of the node, and reactions: pairs of an object and what it tells."""
    for variable in state:
        system.AddSensor(
            items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=variable)
        )
    for item, variable in forces:
        system.AddSensor(
            items.SensorObject(objectNumber=item, storeInternal=True, writeToFile=False, outputVariableType=variable)
        )


def _mechanism(scene: Scene, settings: Any) -> Callable[[FloatArray], FloatArray]:
    if settings.formulation != "redundant":
        raise Refused("there is a bare loop of mechanisms only for redundant coordinates")
    built = Redundant(scene, settings)
    system, dependent = built.system, built.integration.options.linearSolver.ignoreSingularJacobian
    origins = [(built.bodies[body.name], [-float(x) for x in body.com]) for body in mechanism_of(scene).bodies]
    for number, place in origins:
        for variable in (Output.Position, Output.Velocity, Output.AngularVelocity, Output.RotationMatrix):
            kept = {"storeInternal": True, "writeToFile": False, "outputVariableType": variable}
            system.AddSensor(items.SensorBody(bodyNumber=number, localPosition=place, **kept))
    system.Assemble()

    def run(times: FloatArray) -> FloatArray:
        _solve(system, settings, times, dependent=dependent)
        return np.array([system.GetObjectOutputBody(number, Output.Position, place) for number, place in origins])

    return run


def _rigid(
    model: Carrier | RollingDisc, body: RollingBall, settings: Any, forces: list[tuple[Any, Any]]
) -> Callable[[FloatArray], FloatArray]:
    """A run of a model with a rigid ball, from the start that its builder found."""
    system, ball = model.system, model.ball
    data = system.systemData
    start = data.GetODE2Coordinates_tt(exu.ConfigurationType.Initial), data.GetAECoordinates()
    if ball.resistance is not None:
        system.SetLoadParameter(ball.resistance, "loadVectorUserFunction", _resistance(body, ball.node))
    _sensors(
        system,
        ball.node,
        forces,
        [Output.Position, Output.CoordinatesTotal, Output.Velocity, Output.AngularVelocity],
    )
    system.Assemble()

    def run(times: FloatArray) -> FloatArray:
        _solve(system, settings, times, start)
        return np.array(system.GetNodeOutput(ball.node, Output.Position))

    return run


def _resistance(body: RollingBall, node: Any) -> Any:
    """Moment f N e1 × v/V with N = m V²/c."""
    factor = body.contact.rolling_resistance * body.ball.mass / body.surface.length_scales[0]
    position, velocity = Output.Position, Output.Velocity

    def moment(system: Any, t: float, load: Any) -> list[float]:  # noqa: ARG001 -- Exudyn's signature
        x, y, _ = system.GetNodeOutput(node, position).tolist()
        vx, vy, vz = system.GetNodeOutput(node, velocity).tolist()
        r = math.sqrt(x * x + y * y)
        ex, ey = x / r, y / r
        along = vy * ex - vx * ey
        scale = factor * along * along / (math.hypot(along, vz) or 1.0)
        return [scale * ey * vz, -scale * ex * vz, scale * along]

    return moment


def _carrier(body: RollingBall, settings: Any) -> Callable[[FloatArray], FloatArray]:
    model = Carrier(body, settings)
    return _rigid(model, body, settings, [(model.joint, Output.ForceLocal)])


def _rolling_disc(body: RollingBall, settings: Any) -> Callable[[FloatArray], FloatArray]:
    model = RollingDisc(body, settings)
    node, joint, position, rotation = model.ball.node, model.joint, Output.Position, Output.RotationMatrix

    def aim(system: Any, t: float, newton_iteration: int, discontinuous_iteration: int) -> None:  # noqa: ARG001 -- Exudyn's signature
        x, y, _ = system.GetNodeOutput(node, position).tolist()
        r = system.GetNodeOutput(node, rotation).tolist()
        size = math.sqrt(x * x + y * y)
        ex, ey = x / size, y / size
        system.SetObjectParameter(joint, "planeNormal", [-ex, -ey, 0.0])
        system.SetObjectParameter(joint, "discAxis", [ex * r[k + 3] - ey * r[k] for k in (0, 1, 2)])

    model.system.SetPreNewtonResidualUserFunction(aim)
    return _rigid(model, body, settings, [(joint, Output.ForceLocal), (joint, Output.RotationMatrix)])
