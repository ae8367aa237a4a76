"""Terms of a step's equations with contacts, Pinocchio's solvers, and the impulses that these find."""

from collections.abc import Collection
from typing import Any, NamedTuple

import pinocchio as pin

from proofroll.elements.mechanism import WORLD
from proofroll.elements.mechanism.contact.touching import AT_REST, Moving, Touching
from proofroll.elements.mechanism.run.contacts.step_events import States
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree

# Pinocchio's cone needs a number for unbounded friction. PGS accepts any; the iterations of ADMM grow with it.
LARGEST_FRICTION = {"pgs": 1e6, "admm": 1e2}
# Pinocchio's limit of 1000 is reached at tight tolerances where the normal force is small.
_ADMM_ITERATIONS = 10_000


class Impulses(NamedTuple):
    """Impulses of a step.

    Attributes:
        v: velocity after it, shape (nv,).
        impulse: on body a of each contact, world axes [N s], shape (contacts, 3).
        states: of the contacts: open, sticking or with their impulse on the cone.
        moment: of friction against turning on body a of each contact, world axes [N m s], shape (contacts, 3).
        along: impulses of joint rows [N s, N m s], shape (rows,).
        driving: impulses that impose motions [N s, N m s], shape (motions,).
    """

    v: Array
    impulse: Array
    states: States
    moment: Array
    along: Array
    driving: Array


class StepTerms(NamedTuple):
    """Terms of a step's equations.

    Attributes:
        rows: of contacts and joints, (rows, nv).
        J: contact rows, (contacts, 3, nv): slip velocities along the normal's :func:`frame_of_axis`, the normal last.
        free, at_free: velocity after the step without impulses, (nv,), and of the rows, (rows,).
        inverse: of the mass matrix, (nv, nv).
        into, response: velocities by a unit impulse along each row, (nv, rows), and of the rows, (rows, rows).
        touching: geometry of the contacts.
        frames: of their normals.
    """

    rows: Array
    J: Array
    free: Array
    at_free: Array
    inverse: Array
    into: Array
    response: Array
    touching: list[Touching]
    frames: list[Array]


class MovingBodies:
    """Bodies that touch, as Pinocchio's ``data`` places and moves them."""

    def __init__(self, tree: JointTree, bodies: Collection[str]) -> None:
        self._tree, self.data = tree, tree.model.createData()
        frames = [(body, tree.body[tree.mechanism.body_index[body]]) for body in bodies if body != WORLD]
        # their numbers are those of the data at any time: each look at a vector of Pinocchio costs a microsecond
        poses = [self.data.oMf[frame] for _, frame in frames]
        self._views = [(*named, pose.translation, pose.rotation) for named, pose in zip(frames, poses, strict=True)]

    def at(self, q: Array, v: Array) -> dict[str, Moving]:
        """Motion of each body, valid until the next call, with positions and velocities of all joints in ``data``."""
        model, data, velocity = self._tree.model, self.data, self._tree.velocity
        pin.forwardKinematics(model, data, q, v)
        pin.updateFramePlacements(model, data)
        moving = {WORLD: AT_REST}
        for body, frame, p, R in self._views:
            twist = velocity(data, frame)
            moving[body] = Moving(p, R, twist.linear, twist.angular)
        return moving


class SolverParts(NamedTuple):
    """Pinocchio's objects for a subset of contacts and joint rows: constraints, and what :func:`solver_of` gives.

    Attributes:
        ends: end of each contact and joint row among the rows of the subset.
        rows: these among all rows.
    """

    points: list[Any]
    point_datas: list[Any]
    ends: list[int]
    rows: list[int] | slice
    models: Any
    datas: Any
    solver: tuple[Any, Any, Any]


def solver_of(kind: str, tolerance: float, size: int = 3) -> tuple[Any, Any, Any]:
    """Solver, its options and its result object for ``size`` rows."""
    if kind == "pgs":
        solver, options, result = pin.PGSConstraintSolver(size), pin.PGSSolverSettings(), pin.PGSSolverResult()
    else:
        solver, options, result = pin.ADMMConstraintSolver(size), pin.ADMMSolverSettings(), pin.ADMMSolverResult()
        options.max_iterations = _ADMM_ITERATIONS
    for name in ("feasibility", "complementarity"):
        for bound in ("absolute", "relative"):
            setattr(options, f"{bound}_{name}_tol", tolerance)
    return solver, options, result
