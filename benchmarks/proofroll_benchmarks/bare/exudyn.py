"""Exudyn without the adapter: one call of its solver over the whole horizon, with sensors that keep the samples.

The model in minimal coordinates is built here. For mechanisms, and for the three with a rigid ball, the items and their
consistent start come from the adapter's builders, since a user would add the same ones; all user functions that run
while Exudyn integrates are written here, for the vertical cylinder.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, Refused
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.engines.exudyn.ball.carrier import Carrier
from proofroll.engines.exudyn.ball.contact import PenaltyContact
from proofroll.engines.exudyn.ball.rolling_disc import RollingDisc
from proofroll.engines.exudyn.integration import new_system, simulation_settings
from proofroll.engines.exudyn.native import Output, exu, items
from proofroll.engines.exudyn.smooth.redundant import Redundant
from proofroll_benchmarks.bare import Bare, in_vertical_cylinder, is_mechanism

Start = tuple[FloatArray, FloatArray]


def prepare(scene: Scene, settings: Any) -> Bare:
    """See :mod:`proofroll_benchmarks.bare`."""
    restarted = "Newton's method is restarted at every sample, and ends within its tolerance"
    if is_mechanism(scene):
        return Bare(_mechanism(scene, settings), 1e-7, restarted)
    body = in_vertical_cylinder(scene)
    loop = {"generic": _generic, "carrier": _carrier, "rolling_disc": _rolling_disc, "contact": _contact}
    run = loop[settings.formulation](body, settings)
    if settings.formulation == "contact":
        return Bare(run, 1e-8, f"{restarted}, which the stiff contact magnifies")
    return Bare(run, 1e-9, restarted)


def _solve(
    system: Any,
    settings: Any,
    times: FloatArray,
    start: Start | None = None,
    stopped: Sequence[str] = (),
    *,
    dependent: bool = False,
) -> None:
    """Exudyn's solver over the whole time, without its stopwatches; ``stopped`` says why a user function ended it."""
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
    if not solver.SolveSteps(system, options) or stopped:
        raise Diverged(stopped[0] if stopped else "Exudyn's solver failed")


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


def _generic(body: RollingBall, settings: Any) -> Callable[[FloatArray], FloatArray]:
    """Coordinates q = (distance towards the wall, γ, z, and three coordinates whose rates are ω1, ω2, ω3)."""
    m, J, a, c = body.ball.mass, body.ball.inertia, body.ball.radius, body.surface.length_scales[0]
    f, g, mc = body.contact.rolling_resistance, -float(body.gravity[2]), m * c
    frame = body.surface.frame(body.u0)
    _, system = new_system()
    node = system.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=[0.0] * 6,
            initialCoordinates=[0.0] * 6,
            initialCoordinates_t=[0.0, *body.udot0, *(frame.T @ body.w0)],
            numberOfODE2Coordinates=6,
        )
    )

    def force(system: Any, t: float, item: int, q: list[float], rates: list[float]) -> list[float]:  # noqa: ARG001 -- Exudyn's signature
        out, turn, rise, w1, w2, _ = rates
        N = mc * turn * turn
        M2 = M3 = 0.0
        if f:
            scale = f * N / math.hypot(c * turn, rise)
            M2, M3 = -scale * rise, scale * c * turn
        return [N, -2 * mc * out * turn, -m * g, J * turn * w2, M2 - J * turn * w1, M3]

    system.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=[node], massMatrix=np.diag([m, m * c * c, m, J, J, J]), forceUserFunction=force
        )
    )
    ground = system.AddNode(items.NodePointGround())
    ends = [system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=n, coordinate=0)) for n in (ground, node)]
    wall = system.AddObject(items.CoordinateConstraint(markerNumbers=ends))
    both = [system.AddMarker(items.MarkerNodeCoordinates(nodeNumber=n)) for n in (ground, node)]
    rows = np.array([[0.0, c, 0.0, 0.0, 0.0, a], [0.0, 0.0, 1.0, 0.0, -a, 0.0]])
    rolling = system.AddObject(
        items.CoordinateVectorConstraint(markerNumbers=both, scalingMarker1=rows, velocityLevel=True)
    )
    _sensors(
        system,
        node,
        [(wall, Output.Force), (rolling, Output.Force)],
        [Output.Coordinates, Output.Coordinates_t],
    )
    system.Assemble()

    def run(times: FloatArray) -> FloatArray:
        _solve(system, settings, times)
        out, angle, height = system.systemData.GetODE2Coordinates()[:3].tolist()
        return np.array([(c + out) * math.cos(angle), (c + out) * math.sin(angle), height])

    return run


def _rigid(
    model: Carrier | RollingDisc | PenaltyContact, body: RollingBall, settings: Any, forces: list[tuple[Any, Any]]
) -> Callable[[FloatArray], FloatArray]:
    """A run of a model with a rigid ball, from the start that its builder found."""
    system, ball, stopped = model.system, model.ball, list[str]()
    data = system.systemData
    consistent = not isinstance(model, PenaltyContact)
    start = (data.GetODE2Coordinates_tt(exu.ConfigurationType.Initial), data.GetAECoordinates()) if consistent else None
    if ball.resistance is not None:
        system.SetLoadParameter(ball.resistance, "loadVectorUserFunction", _resistance(body, ball.node))
    _sensors(
        system,
        ball.node,
        forces,
        [Output.Position, Output.CoordinatesTotal, Output.Velocity, Output.AngularVelocity],
    )
    if isinstance(model, PenaltyContact):
        system.SetPostStepUserFunction(_watch(model, stopped))
    system.Assemble()

    def run(times: FloatArray) -> FloatArray:
        _solve(system, settings, times, start, stopped)
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


def _contact(body: RollingBall, settings: Any) -> Callable[[FloatArray], FloatArray]:
    model = PenaltyContact(body, settings)
    node, follower, position = model.ball.node, model.follower, Output.Position

    def follow(system: Any, t: float, newton_iteration: int, discontinuous_iteration: int) -> None:  # noqa: ARG001 -- Exudyn's signature
        # A hollow sphere as wide as the cylinder, with its centre on the axis at the ball's height.
        system.SetMarkerParameter(follower, "localPosition", [0.0, 0.0, float(system.GetNodeOutput(node, position)[2])])

    model.system.SetPreNewtonResidualUserFunction(follow)
    return _rigid(model, body, settings, [(model.contact, Output.Force)])


def _watch(model: PenaltyContact, stopped: list[str]) -> Callable[[Any, float], bool]:
    """Callback after each step: false if the contact is lost, or slips."""
    data, coordinates = model.data, Output.Coordinates
    zone = model.zone

    def watch(system: Any, t: float) -> bool:
        gap, speed, *_ = system.GetNodeOutput(data, coordinates).tolist()
        if gap > 0:
            stopped.append(f"the ball leaves the wall at {t:g} s")
        if speed > 2 * zone:
            stopped.append(f"the ball slips at {t:g} s")
        return not stopped

    return watch
