"""Sparse elimination, in numbers and long doubles."""

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.bodies.maximal_equations import FUNCTIONS
from proofroll.truth.bodies.maximal_taylor import BodySystem
from proofroll.truth.numerics.elimination import Row, eliminated


@pytest.mark.parametrize("symmetric", [True, False])
def test_constraints_wait_for_what_they_hold(symmetric: bool) -> None:
    """A chain of masses whose constraints come first, with zeros on the diagonal, is solved as by a dense method."""
    rng, n, m = np.random.default_rng(5), 6, 3
    C = np.zeros((m, n))
    for k in range(m):
        C[k, k : k + 3] = rng.uniform(0.5, 2.0, 3)
    P = C if symmetric else C * rng.uniform(0.9, 1.1, C.shape)
    A = np.block([[np.zeros((m, m)), C], [P.T, np.diag(rng.uniform(1.0, 2.0, n))]])
    rows: list[Row] = [{j: float(value) for j, value in enumerate(row) if value} for row in A]
    after = [set(np.flatnonzero(row).tolist()) if k < m else set() for k, row in enumerate(A)]
    b = rng.uniform(-1.0, 1.0, (2, n + m))
    answers, pivots = eliminated(rows, b.tolist(), after, symmetric=symmetric)
    assert np.array(answers) == pytest.approx(np.linalg.solve(A, b.T).T, rel=1e-12)
    assert np.prod(pivots) == pytest.approx(np.linalg.det(A), rel=1e-12)


@pytest.mark.parametrize("name", ["arm_pd", "car_axis", "joint_bench"])
def test_joints_hold_to_the_last_digit_of_long_doubles(name: str) -> None:
    """Accelerations of bodies, with motors and without inertia, keep the rows of joints as exactly as scalars can."""
    bodies = MaximalCoordinates(mechanism_named(name)).lean
    equations, rng = bodies.equations, np.random.default_rng(1)
    state = equations.start().astype(np.longdouble)
    state[equations.nx :] += rng.normal(size=len(state) - equations.nx)
    at_state = equations.at(list(state), {**FUNCTIONS, "sqrt": np.sqrt})
    joints = [at_state.rows[k] for k in bodies.independent_rows()]
    u_rate = BodySystem(equations, at_state, joints, number=np.longdouble).accelerated(at_state.force)[0]
    for row in joints:
        parts = [value * u_rate[k] for k, value in row.coefficients.items()]
        size = abs(row.bias) + sum(map(abs, parts)) + 1.0
        assert abs(sum(parts) + row.bias) <= 100 * np.finfo(np.longdouble).eps * size
