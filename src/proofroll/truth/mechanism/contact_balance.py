"""Balance of bodies at rest by forces of contacts within their cones and bounds."""

from collections.abc import Sequence

import numpy as np

from proofroll.elements.mechanism.analysis import RANK
from proofroll.elements.mechanism.rotations import Array, frame_of_axis
from proofroll.truth.mechanism.contact_equations import BodiesState, ContactEquations
from proofroll.truth.mechanism.contact_guards import AT_REST

SLACK = 1e-9  # violation of an inequality, relative to the forces involved, up to which it counts as kept
_SHARING = 2  # least number of contacts that may share a load
_SIDES = 180  # sides of a pyramid inside each friction cone, for the test of balance at rest


def balanced(equations: ContactEquations, bodies: BodiesState, closed: Sequence[bool]) -> bool:
    """True if nothing moves and forces within the cones and bounds of friction balance all loads."""
    from scipy.optimize import nnls

    if np.abs(bodies.u).max() > AT_REST:
        return False
    columns, bounds = [bodies.C.T, -bodies.C.T, *cone_loads(equations, bodies, closed)], equations.bounds
    size, count = float(np.linalg.norm(bodies.force)), sum(each.shape[1] for each in columns)
    rubs = bodies.J[bounds > 0].sum(axis=1)  # the slide of these has one component
    # A bounded friction has a part in each direction and a remainder; the three sum to the bound.
    parts = np.kron([1.0, 1.0, 1.0], np.eye(len(rubs))) * size
    matrix = np.block([[*columns, rubs.T, -rubs.T, 0 * rubs.T], [np.zeros((len(rubs), count)), parts]])
    aims = np.concatenate([-bodies.force, size * bounds[bounds > 0]])
    return bool(nnls(matrix, aims, maxiter=100 * matrix.shape[1])[1] <= SLACK * size)


def held_together(equations: ContactEquations, bodies: BodiesState, closed: Sequence[bool]) -> bool:
    """True if contacts share loads, and forces within their cones let all of them stick while bodies move."""
    from scipy.optimize import nnls

    if sum(closed) < _SHARING or equations.bounds.any():
        return False
    which = np.flatnonzero(closed)
    held = np.concatenate(bodies.J[which])
    if np.linalg.matrix_rank(held @ np.linalg.solve(bodies.mass, held.T), RANK, hermitian=True) == len(held):
        return False
    rows = np.concatenate([bodies.C, held])
    rates = np.concatenate([bodies.of_joints, bodies.bias[which].ravel()])
    loads = np.column_stack([bodies.C.T, -bodies.C.T, *cone_loads(equations, bodies, closed)])
    inertial = np.linalg.solve(bodies.mass, np.column_stack([bodies.force, loads]))
    aims = -(rows @ inertial[:, 0] + rates)
    size = max(float(np.linalg.norm(aims)), AT_REST)
    return bool(nnls(rows @ inertial[:, 1:], aims, maxiter=100 * loads.shape[1])[1] <= SLACK * size)


def cone_loads(equations: ContactEquations, bodies: BodiesState, closed: Sequence[bool]) -> list[Array]:
    """Loads by unit normal forces with friction in the directions of a pyramid, for each closed contact."""
    angles, loads = np.linspace(0, 2 * np.pi, _SIDES, endpoint=False), []
    for each, J, mu, shut in zip(bodies.touching, bodies.J, equations.static, closed, strict=True):
        if shut:
            frame = frame_of_axis(each.normal)
            sides = np.outer(np.cos(angles), frame[:, 0]) + np.outer(np.sin(angles), frame[:, 1])
            if np.isinf(mu):  # the half space of directions that press
                ways = np.column_stack([each.normal, frame[:, 0], -frame[:, 0], frame[:, 1], -frame[:, 1]])
                loads.append(J.T @ ways)
                continue
            loads.append(J.T @ (each.normal + mu * sides).T)
    return loads
