"""Recursive elimination in scalars, from the tips of the tree to the world and back; compiled by heyoka.

Its cost is linear in the number of bodies, without a matrix of all velocities, so its formulas stay few enough for a
compiler.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.core.errors import Refused
from proofroll.core.heyoka_library import require_heyoka
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.projection.smooth.connections import SKEW, Bodies, ProjectedConnections
from proofroll.engines.projection.smooth.dependent import DependentCoordinates
from proofroll.engines.projection.smooth.elimination import Closing, Elimination, Loads

# Number of bodies up to which code is compiled as a whole; larger trees are compiled in parts: slower code, but a
# compile time linear in the number of bodies.
_WHOLE = 10


class Recursion(Elimination):
    """Tree of a mechanism without loops; twists have six components: ω and the velocity at the origin."""

    def __init__(self, mechanism: Mechanism, connections: ProjectedConnections) -> None:
        super().__init__(mechanism, connections)
        count = len(mechanism.joints)
        self._child, self._parent = connections.b[:count].tolist(), connections.a[:count].tolist()
        self._velocities = [np.flatnonzero(self.joint == number).tolist() for number in range(count)]
        self._world = len(mechanism.bodies)

    def motions(
        self, bodies: Bodies, relative: Array, loads: Loads, closing: Closing | None = None
    ) -> tuple[Array, Array, Array]:
        """See :meth:`Elimination.motions`."""
        assert closing is None
        S = _six(self.directions(bodies))
        steps = _six(relative.reshape(*relative.shape[:-1], 4, 4))
        pushes = np.zeros((*relative.shape[:-2], self._world, 6), dtype=S.dtype)
        if isinstance(loads.bent, np.ndarray):
            pushes[...] = _moments(loads.pulls - self.forces(bodies, loads.bent))
        drives = np.zeros(len(S)) + loads.drives
        inertia = [_spatial(body_inertia) for body_inertia in self.inertia(bodies)]
        parts: list[tuple[Array, Array]] = [(S[0], S[0])] * len(S)
        for number in reversed(range(len(self._child))):
            body, parent = self._child[number], self._parent[number]
            solid, push = inertia[body], pushes[..., body, :] - steps[..., number, :] @ inertia[body]
            for k in reversed(self._velocities[number]):
                U = solid @ S[k]
                D = S[k] @ U + self.armature[k]
                rate = (push @ S[k] + drives[..., k]) / D
                parts[k] = U / D, rate
                solid, push = solid - np.outer(U, U / D), push - np.multiply.outer(rate, U)
            if parent != self._world:
                inertia[parent] = inertia[parent] + solid
                pushes[..., parent, :] += push
        twists = np.zeros((*relative.shape[:-2], self._world + 1, 6), dtype=S.dtype)
        velocities = np.zeros((*relative.shape[:-2], len(S)), dtype=S.dtype)
        for number, (body, parent) in enumerate(zip(self._child, self._parent, strict=True)):
            motion = twists[..., parent, :]
            for k in self._velocities[number]:
                part, rate = parts[k]
                velocities[..., k] = rate - motion @ part
                motion = motion + np.multiply.outer(velocities[..., k], S[k])
            twists[..., body, :] = motion + steps[..., number, :]
        return _four(twists), velocities, np.zeros(0)


def compiled(mechanism: Mechanism) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """Compiled rates of the state, and projection of the state onto the constraints, of :class:`DependentCoordinates`.

    Raises:
        Missing: heyoka is not installed.
        Refused: the mechanism has loops, couplings, or springs that depend on turns.
    """
    if mechanism.loops:
        raise Refused("singular values of loops are not compiled; choose preset=matched")
    if mechanism.couplings:
        raise Refused("rows of couplings are not compiled; choose preset=matched")
    equations = DependentCoordinates(mechanism, Recursion)
    if equations.applied.remembers:
        raise Refused(
            "springs of joints remember how often these have turned, and are not compiled; choose preset=matched"
        )
    require_heyoka("equations=compiled")
    import heyoka

    numbers = heyoka.make_vars(*(f"x{number}" for number in range(len(equations.start))))
    x = np.array(numbers, dtype=object)
    in_parts = len(mechanism.bodies) > _WHOLE

    def of(formulas: Any) -> Callable[[Array], Array]:
        expressions = [
            item if isinstance(item, heyoka.expression) else heyoka.expression(float(item)) for item in formulas
        ]
        function: Callable[[Array], Array] = heyoka.cfunc(expressions, numbers, compact_mode=in_parts)
        return function

    return of(equations.rates(x)), of(equations.eliminated(x))


def _six(twists: Array) -> Array:
    """Components (ω, v) of twists [ω× v; 0 0]."""
    flat = twists[..., :3, :3].reshape(*twists.shape[:-2], 9)
    return np.concatenate([0.5 * flat @ SKEW.T, twists[..., :3, 3]], axis=-1)


def _four(twists: Array) -> Array:
    matrices = np.zeros((*twists.shape[:-1], 4, 4), dtype=twists.dtype)
    matrices[..., :3, :3] = (twists[..., :3] @ SKEW).reshape(*twists.shape[:-1], 3, 3)
    matrices[..., :3, 3] = twists[..., 3:]
    return matrices


def _moments(forces: Array) -> Array:
    """Spatial forces (moment about the origin, force), shape (..., 6), from their 4×4 matrices f pᵀ."""
    flat = forces[..., :3, :3].reshape(*forces.shape[:-2], 9)
    return np.concatenate([flat @ SKEW.T, forces[..., :3, 3]], axis=-1)


def _spatial(inertia: Array) -> Array:
    """Spatial inertia, shape (6, 6), from a body's matrix Σ of moments of mass (:mod:`.elimination`), shape (4, 4)."""
    matrix = np.zeros((6, 6), dtype=inertia.dtype)
    matrix[:3, :3] = np.eye(3) * np.trace(inertia[:3, :3]) - inertia[:3, :3]
    matrix[:3, 3:] = (inertia[:3, 3] @ SKEW).reshape(3, 3)
    matrix[3:, :3] = matrix[:3, 3:].T
    matrix[3:, 3:] = np.eye(3) * inertia[3, 3]
    return matrix
