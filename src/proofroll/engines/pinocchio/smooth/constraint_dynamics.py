"""Formulation ``constraint_dynamics``: loops as Pinocchio's own rigid constraints, solved by its proximal method.

Pinocchio constrains points or whole frames, nothing in between. A revolute loop is two points on its axis (one if the
mechanism is planar); other loops are not supported. Without the proximal term μ, dependent rows give NaN.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import WORLD, Loop
from proofroll.elements.mechanism.dynamics.loop_points import held_points
from proofroll.elements.mechanism.run.capabilities import ALL_LOOPS, MechanismCapability
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.engines.pinocchio.smooth import joint_tree
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree

_POINTS = {MechanismCapability.SPHERICAL_LOOP, MechanismCapability.REVOLUTE_LOOP}
_NO_ROWS = "Pinocchio's rigid constraints hold points or whole frames together, and no single angle or direction"
_COUPLINGS = {MechanismCapability[name] for name in ("COUPLINGS", "COUPLINGS_OF_MANY", "MASSLESS", "MOTIONS")}
PROVIDES = (joint_tree.PROVIDES - ALL_LOOPS | _POINTS) - _COUPLINGS
LACKING: Mapping[str, str] = {**joint_tree.LACKING, **dict.fromkeys((ALL_LOOPS - _POINTS) | _COUPLINGS, _NO_ROWS)}
# Of the proximal method.
ITERATIONS, ACCURACY = 50, 1e-14
_STEPS = {
    "rk4": "# classical Runge-Kutta with dt = {0.dt!r} s; places by pin.integrate(model, q, v * dt)",
    "dop853": "# scipy.integrate.DOP853 with rtol = {0.rtol!r}; places by the rates of q",
}


class ConstraintDynamics:
    """Accelerations and reactions of a tree with Pinocchio's rigid constraints.

    Attributes:
        constraints: Pinocchio's constraint models.
        proximal: accuracy, μ and maximum iterations of the proximal method.
        on_couplings, on_motions: forces of couplings and of prescribed motions; empty, as there are none.
    """

    def __init__(self, tree: JointTree, proximal: float) -> None:
        """Builds the constraints; ``proximal`` is the regularisation μ of Pinocchio's proximal solver."""
        self._tree, self._model, self.on_couplings, self.on_motions = tree, tree.model, np.zeros(0), np.zeros(0)
        self.proximal = ACCURACY, proximal, ITERATIONS
        self._proximal = pin.ProximalSettings(*self.proximal)
        self.constraints, self._loops = pin.StdVec_RigidConstraintModel(), []
        for number, (loop, (a, b)) in enumerate(zip(tree.mechanism.loops, tree.loops, strict=True)):
            for point in held_points(tree.mechanism, loop):
                ends: list[Any] = []
                for frame in (b, a) if self._first_is_b(loop) else (a, b):
                    on = self._model.frames[frame]
                    ends += [on.parentJoint, on.placement * pin.SE3(np.eye(3), np.array([0.0, 0.0, point]))]
                kind = pin.ContactType.CONTACT_3D
                self.constraints.append(pin.RigidConstraintModel(kind, self._model, *ends, pin.LOCAL))
                self._loops.append(number)
        self._results = pin.StdVec_RigidConstraintData()
        for constraint in self.constraints:
            self._results.append(constraint.createData())
        self._ready: Any = None  # the data for which constraints were initialised

    @staticmethod
    def _first_is_b(loop: Loop) -> bool:
        """True if Pinocchio's first joint carries body_b: its solver crashes if the first joint is the world."""
        return loop.body_a == WORLD

    def acceleration(self, data: Any, q: Array, v: Array) -> Array:
        """Joint acceleration, shape (nv,), overwritten by the next call."""
        tree, model = self._tree, self._model
        tau = tree.drives(q, v)
        if tree.pushed:  # constraintDynamics takes no external forces, so they act as joint torques
            pin.forwardKinematics(model, data, q, v)
            pin.updateFramePlacements(model, data)
            rest = np.zeros(model.nv)
            with_pulls = pin.rnea(model, data, q, rest, rest, tree.pulls(data)).copy()
            tau = tau + pin.rnea(model, data, q, rest, rest) - with_pulls
        if self._ready is not data:
            pin.initConstraintDynamics(model, data, self.constraints, self._results)
            self._ready = data
        acceleration: Array = pin.constraintDynamics(
            model, data, q, v, tau, self.constraints, self._results, self._proximal
        )
        return acceleration

    def reactions(self, data: Any, q: Array, v: Array) -> tuple[Array, Any, Array]:
        """Joint acceleration; spring and loop forces on Pinocchio's joints; force and moment on body_b of each loop."""
        tree = self._tree
        acceleration = self.acceleration(data, q, v).copy()
        pin.updateFramePlacements(self._model, data)
        pin.forwardKinematics(self._model, data, q, v)
        forces = tree.pulls(data)
        on_loops = np.zeros((2, len(tree.loops), 3))
        for number, result in zip(self._loops, self._results, strict=True):
            a, b = tree.loops[number]
            on_first = result.oMc1.rotation @ result.contact_force.linear
            on_b = on_first if self._first_is_b(tree.mechanism.loops[number]) else -on_first
            place = result.oMc1.translation
            tree.put(forces, data, b, place, on_b)
            tree.put(forces, data, a, place, -on_b)
            on_loops[0, number] += on_b
            on_loops[1, number] += np.cross(place - data.oMf[b].translation, on_b)
        return acceleration, forces, on_loops

    def constraint_rows(self, data: Any, q: Array, v: Array) -> Array:
        """Jacobian of Pinocchio's constraints for joint velocities, shape (rows, nv)."""
        if not self._loops:
            return np.zeros((0, self._model.nv))
        self.acceleration(data, q, v)
        pin.computeJointJacobians(self._model, data, q)
        J = pin.getConstraintsJacobian(self._model, data, self.constraints, self._results)
        return np.reshape(J, (-1, self._model.nv))


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
