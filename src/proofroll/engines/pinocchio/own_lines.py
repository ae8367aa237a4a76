"""Settings as lines of a user's own Pinocchio program."""

from proofroll.core.errors import Refused
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.engines.pinocchio.smooth.constraint_dynamics import ACCURACY, ITERATIONS

_STEPS = {
    "rk4": "# classical Runge-Kutta with dt = {0.dt!r} s; places by pin.integrate(model, q, v * dt)",
    "dop853": "# scipy.integrate.DOP853 with rtol = {0.rtol!r}; places by the rates of q",
}


def own_lines(settings: PinocchioSettings) -> list[str]:
    """See :class:`proofroll.core.engine_abilities.TellsLines`: the acceleration, and how it is integrated.

    Raises:
        Refused: a formulation whose equations are proofroll's.
    """
    if settings.formulation != "constraint_dynamics":
        raise Refused(f"the equations of {settings.formulation} are proofroll's, built of Pinocchio's terms")
    return [
        "data = model.createData()",
        "results = pin.StdVec_RigidConstraintData()",
        "for constraint in constraints:  # a pin.StdVec_RigidConstraintModel, one for each loop",
        "    results.append(constraint.createData())",
        f"proximal = pin.ProximalSettings({ACCURACY:g}, {settings.proximal:g}, {ITERATIONS})",
        "pin.initConstraintDynamics(model, data, constraints, results)",
        "a = pin.constraintDynamics(model, data, q, v, tau, constraints, results, proximal)",
        _STEPS[settings.integrator].format(settings),
        *(["# after each step: q and v back on the constraints"] if settings.projection else []),
    ]
