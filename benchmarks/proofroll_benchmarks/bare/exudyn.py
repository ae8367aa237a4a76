"""Exudyn without the adapter: of a ball one call of its solver over all times, with sensors that keep the samples.

Of a mechanism its solver goes from sample to sample.

The items and their consistent start come from the adapter's builders, since a user would add the same ones; all user
functions that run while Exudyn integrates are written here, for the vertical cylinder.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.contact.rolling_and_spin import turning_frictions
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall
from proofroll.engines.exudyn.integration import simulation_settings
from proofroll.engines.exudyn.native import Output, exu, items
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.exudyn.carrier import Carrier
from proofroll.papers.blajer_2006.exudyn.formulations import RollingDisc
from proofroll_benchmarks.bare import Bare, in_vertical_cylinder

Exudyn = load_engine("exudyn")

Start = tuple[FloatArray, FloatArray]


def prepare(scene: Scene, settings: Any) -> Bare:
    """See :mod:`proofroll_benchmarks.bare`."""
    restarted = "Newton's method is restarted at every sample, and ends within its tolerance"
    loops = {"carrier": _carrier, "rolling_disc": _rolling_disc}
    if settings.formulation not in loops:
        return _mechanism(scene, settings)
    return Bare(loops[settings.formulation](in_vertical_cylinder(scene), settings), 1e-9, restarted)


def _solve(
    system: Any,
    settings: Any,
    times: FloatArray,
    start: Start,
) -> None:
    """Exudyn's solver over the whole time, without its stopwatches."""
    options = simulation_settings(settings)
    time = options.timeIntegration
    time.numberOfSteps, time.endTime = round(float(times[-1]) / settings.dt), float(times[-1])
    options.solution.sensors.active = True
    options.solution.sensors.writePeriod = float(times[1])
    time.generalizedAlpha.computeInitialAccelerations = False
    solver = exu.MainSolverImplicitSecondOrder()
    system.systemData.SetODE2Coordinates_tt(start[0], exu.ConfigurationType.Initial)
    solver.InitializeSolver(system, options)
    timer = solver.timer
    timer.useTimer = False
    solver.timer = timer
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


def _mechanism(scene: Scene, settings: Any) -> Bare:
    """Items of the adapter; without the walls that follow a ball, and torques against turning, which Exudyn has not."""
    built = Exudyn.build(scene, settings)
    system, solver, options = built.system, built.integration.solver, built.integration.options
    contacts = mechanism_of(scene).contacts
    parts = {
        "wall": any(isinstance(shape, CurvedWall) for item in contacts for shape in (item.shape_a, item.shape_b)),
        "rolling resistance": bool(turning_frictions(contacts)),
    }
    lacks = " and ".join(part for part, present in parts.items() if present)
    if lacks:
        system.SetPreNewtonResidualUserFunction(0)
        for number in range(system.systemData.NumberOfLoads()):
            if "loadVectorUserFunction" in system.GetLoad(number):
                system.SetLoadParameter(number, "loadVectorUserFunction", 0)

    def run(times: FloatArray) -> FloatArray:
        time = solver.it
        for begin, end in itertools.pairwise(times.tolist()):
            time.startTime = time.currentTime = begin
            time.endTime, time.numberOfSteps = end, round((end - begin) / settings.dt)
            if not solver.SolveSteps(system, options):
                raise Diverged("Exudyn's solver failed")
        return np.array(built.sample().p_WB)

    return Bare(run, 1e-12, "the steps are the same", lacks)


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
