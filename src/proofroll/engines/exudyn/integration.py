"""Exudyn's own time integration, driven from sample to sample without losing its state, and its settings as lines."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.errors import Diverged, Refused
from proofroll.engines.exudyn.native import ExudynError, exu, new_settings
from proofroll.engines.exudyn.settings import EXPLICIT, ExudynSettings

# Settings that say what a run writes and how long it is.
_OF_A_RUN = (
    "solution",
    "parallel",
    "timeIntegration.endTime",
    "timeIntegration.numberOfSteps",
    "timeIntegration.verbose",
)
# Round-off of a coordinate of a turn or a metre, which a bristle makes a force of [rad, m].
_ROUNDED = 16 * np.finfo(np.float64).eps


def new_system() -> tuple[Any, Any]:
    """An empty container and system; also silences Exudyn and resets its process-wide timeout."""
    exu.config.printToConsole = False
    exu.special.solver.timeout = -1
    container = exu.SystemContainer()
    return container, container.AddSystem()


class ExudynModel:
    """Run of a formulation in its own Exudyn system; see :class:`proofroll.core.engine.Engine` for the methods."""

    integration: Integration

    def __init__(self) -> None:
        self.container, self.system = new_system()

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.integration.advance(t)


def simulation_settings(
    settings: ExudynSettings, *, dependent: bool = False, mass: float = 1.0, stiffness: float = 0.0
) -> Any:
    """Settings in Exudyn's own structure: no files, one thread, a step that only ``halvings`` may shorten.

    ``dependent``: constraints may depend on each other, so the linear solver must handle a singular matrix.
    ``mass``: of all that moves [kg]; Newton's absolute tolerance is a force [N], and round-off of the forces grows with
    what they move.
    ``stiffness``: of the stiffest bristle or stop [N/m, N m/rad], which makes forces of the round-off of coordinates.
    """
    kind = getattr(exu.DynamicSolverType, settings.integrator.upper()) if settings.integrator in EXPLICIT else None
    result = new_settings(dependent=dependent, explicit=kind)
    result.parallel.numberOfThreads = 1
    time = result.timeIntegration
    time.verboseMode = 0
    # Left alone, a failing Newton iteration halves the step down to 1e-8 s, and the run crawls for minutes.
    time.adaptiveStep = bool(settings.halvings)
    if settings.halvings:
        time.minimumStepSize = settings.dt / 2**settings.halvings
    time.newton.relativeTolerance = settings.newton_tolerance
    time.newton.absoluteTolerance = settings.newton_tolerance / 100 * max(1.0, mass) + _ROUNDED * stiffness
    time.newton.useModifiedNewton = True  # off by default in 1.11, which explains every difference from 1.13
    time.newton.modifiedNewtonJacUpdatePerStep = settings.jacobian == "step"
    alpha = time.generalizedAlpha
    if settings.spectral_radius is not None:
        alpha.spectralRadius = settings.spectral_radius
    alpha.useNewmark = alpha.useIndex2Constraints = settings.integrator == "trapezoidal_index2"
    time.numberOfSteps = 1
    time.endTime = settings.dt
    return result


class Integration:
    """One run of Exudyn's implicit solver over an assembled system.

    The solver is initialised once. ``SolveSteps`` integrates from the start time to the end time in its iteration data
    and keeps coordinates, accelerations and multipliers, so new times continue the run.

    Attributes:
        t: present time [s].
    """

    def __init__(
        self,
        system: Any,
        settings: ExudynSettings,
        turning: Mapping[Any, FloatArray] | None = None,
        at: float = 0.0,
        *,
        dependent: bool = False,
        mass: float = 1.0,
        stiffness: float = 0.0,
        moved: Callable[[float], Mapping[Any, float]] | None = None,
    ) -> None:
        """Initialises the solver in the initial configuration of an assembled system, at the time ``at`` [s].

        For ``turning`` and ``moved`` (at a time) see :func:`consistent_start`; without them, Exudyn finds the start
        itself. For ``dependent``, ``mass`` and ``stiffness`` see :func:`simulation_settings`.

        Raises:
            Refused: the engine does not accept the model.
        """
        self.t = at
        self._again: Callable[[float], Integration] = lambda t: Integration(
            system, settings, at=t, dependent=dependent, mass=mass, stiffness=stiffness, moved=moved
        )
        self.dt = settings.dt
        self._cure = "use a smaller dt" + " or a larger friction_zone" * (settings.friction_zone is not None)
        self.system = system
        self.options = simulation_settings(settings, dependent=dependent, mass=mass, stiffness=stiffness)
        self.options.timeIntegration.startTime, self.options.timeIntegration.endTime = at, at + settings.dt
        explicit = settings.integrator in EXPLICIT
        pushed = moved(at) if moved else {}
        start = None
        if turning is not None or any(pushed.values()):
            start = consistent_start(system, settings, turning or {}, pushed, dependent=dependent)
        self.solver = exu.MainSolverExplicit() if explicit else exu.MainSolverImplicitSecondOrder()
        if start is not None:
            self.options.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
            system.systemData.SetODE2Coordinates_tt(start[0], exu.ConfigurationType.Initial)
        try:
            accepted = self.solver.InitializeSolver(system, self.options)
        except ExudynError as error:
            raise Refused(f"Exudyn does not accept the model: {_sentence(error)}") from None
        if not accepted:
            raise Refused(f"Exudyn does not accept the model: {_sentence(self.solver.GetErrorString())}")
        timer = self.solver.timer  # a copy; Exudyn's own stopwatches cost a fifth of the time of a small model
        timer.useTimer = False
        self.solver.timer = timer
        if start is not None:
            system.systemData.SetAECoordinates(start[1], exu.ConfigurationType.Current)

    def again(self) -> Integration:
        """A new run from the present state, whose accelerations and multipliers belong to the present forces.

        An implicit method keeps accelerations from step to step; after a jump of forces those before it would cost it
        its second order.
        """
        data, initial = self.system.systemData, exu.ConfigurationType.Initial
        for name in ("ODE2Coordinates", "ODE2Coordinates_t", "ODE1Coordinates", "AECoordinates", "DataCoordinates"):
            getattr(data, f"Set{name}")(getattr(data, f"Get{name}")(), initial)
        return self._again(self.t)

    def advance(self, t: float) -> None:
        """Moves the system to time ``t`` [s], or to where a user function of the system stops it after a step."""
        steps = whole_steps(self.t, t, self.dt)
        if steps == 0:
            return
        iteration = self.solver.it
        iteration.startTime = iteration.currentTime = self.t
        iteration.endTime = t
        iteration.numberOfSteps = steps
        try:
            done = self.solver.SolveSteps(self.system, self.options)
        except Exception as error:  # an error in a user function comes out of the engine with its own type
            raise Diverged(f"Exudyn stopped at {self.solver.it.currentTime:g} s: {_sentence(error)}") from None
        reached = self.solver.it.currentTime
        if self.solver.output.simulationStoppedByUserFunction:
            self.t = reached
            return
        # It also reports success when it stopped early, e.g. because exudyn.special.solver.timeout was reached.
        if not done or abs(reached - t) > 0.5 * self.dt:
            raise Diverged(f"Exudyn stopped at {reached:g} s: {self._reason()}")
        self.t = t

    def _reason(self) -> str:
        convergence, output = self.solver.conv, self.solver.output
        if output.simulationTimeout:
            return "its own timeout was reached"
        if convergence.linearSolverFailed or convergence.massMatrixNotInvertible:
            return "the system matrix is singular"
        if convergence.newtonSolutionDiverged or not convergence.newtonConverged:
            return f"Newton's method did not converge; {self._cure}"
        return _sentence(self.solver.GetErrorString()) or "it gives no reason"


def initial_matrices(
    system: Any, settings: ExudynSettings, *, dependent: bool = False
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mass matrix, matrix [0 Cᵀ; C D] of the constraints, and generalised forces, in the initial state.

    D is not zero where a joint has a free axis, whose multiplier Exudyn keeps and sets to zero.

    Uses a solver of its own, so as not to disturb the one that integrates. Afterwards the system's present
    accelerations and multipliers are those that Exudyn finds for the initial state.
    """
    options = simulation_settings(settings, dependent=dependent)
    solver = exu.MainSolverImplicitSecondOrder()
    solver.InitializeSolver(system, options)
    coordinates, size = solver.GetODE2size(), solver.GetODE2size() + solver.GetAEsize()
    solver.ComputeMassMatrix(system)
    mass = np.array(solver.GetSystemMassMatrix())
    solver.SetSystemJacobian(np.zeros((size, size)))  # it holds an inverse after the initialisation
    solver.ComputeJacobianAE(system, 1.0, 1.0)
    jacobian = np.array(solver.GetSystemJacobian())
    solver.ComputeODE2RHS(system)
    forces = np.array(solver.GetSystemResidual())[:coordinates]
    return mass, jacobian, forces


def consistent_start(
    system: Any,
    settings: ExudynSettings,
    turning: Mapping[Any, FloatArray],
    moved: Mapping[Any, float] | None = None,
    *,
    dependent: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """Accelerations of the coordinates and multipliers at time 0 of an assembled system.

    A constraint at velocity level, C q̇ = 0, has the derivative C q̈ = -Ċ q̇. For the constraints used here, Exudyn
    leaves out the right side, and the trapezoidal rule would keep the wrong multipliers as an undamped oscillation. So
    the accelerations and multipliers that Exudyn finds are corrected, by its own matrices, for the missing right side:
    ``turning``, constraint -> -Ċ q̇ of its rows. Of a place that moves Exudyn leaves out the acceleration: ``moved``,
    constraint -> what its row lacks.
    """
    mass, jacobian, _ = initial_matrices(system, settings, dependent=dependent)
    data = system.systemData
    start = np.concatenate([data.GetODE2Coordinates_tt(), data.GetAECoordinates()])
    n = len(mass)
    missing = np.zeros(len(start))
    for item, expected in turning.items():
        rows = np.array(data.GetObjectLTGAE(item))
        missing[n + rows] = expected - jacobian[n + rows] @ start
    for item, acceleration in (moved or {}).items():
        missing[n + np.array(data.GetObjectLTGAE(item))] = acceleration
    jacobian[:n, :n] += mass
    start += np.linalg.lstsq(jacobian, missing, rcond=None)[0] if dependent else np.linalg.solve(jacobian, missing)
    return start[:n], start[n:]


def _sentence(text: object) -> str:
    """Message of Exudyn on one line, without the Python traceback that it appends."""
    return " ".join(str(text).partition("\n\nAt:")[0].split())


def own_lines(settings: ExudynSettings) -> list[str]:
    """See :class:`proofroll.core.engine_abilities.TellsLines`: what differs from a new ``exu.SimulationSettings()``."""
    usual = dict(_leaves(exu.SimulationSettings().GetDictionary()))
    made = dict(_leaves(simulation_settings(settings, dependent=settings.formulation == "redundant").GetDictionary()))
    lines = [
        f"simulationSettings.{name} = {_literal(value)}"
        for name, value in made.items()
        if value != usual.get(name) and not name.startswith(_OF_A_RUN)
    ]
    steps = f"round(simulationSettings.timeIntegration.endTime / {settings.dt!r})"
    lines.append(f"simulationSettings.timeIntegration.numberOfSteps = {steps}")
    if settings.integrator not in EXPLICIT:
        lines.append(
            "# newton.absoluteTolerance: times the moving kilograms, if above 1; more for friction and stops of joints"
        )
    if settings.stiffness is not None:
        lines.append(f"# contact: stiffness {settings.stiffness:g} N/m, friction zone {settings.friction_zone:g} m/s")
    return lines


def _leaves(tree: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{above}{name}.")
        else:
            yield above + name, value


def _literal(value: Any) -> str:
    """Python text of a value; of an enumeration the name that a program writes."""
    return f"exu.{type(value).__name__}.{value.name}" if hasattr(value, "name") else repr(value)
