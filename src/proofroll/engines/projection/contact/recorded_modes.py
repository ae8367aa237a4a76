"""Equations of motion in one mode of few contacts, recorded as plain assignments.

The formulas of the numpy solver are evaluated once on symbols of :mod:`.formula`. The program that comes out has as
many operations as the mode needs, and costs a tenth of numpy's calls for arrays of three numbers.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.modes import ContactMode, slip_velocity
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.dynamics.switches import switched_joints
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import HalfSpace, SphereShape
from proofroll.elements.mechanism.scene.shapes.walls import ConeWall, CurvedWall
from proofroll.elements.mechanism.scene.shapes.walls.formula import RecordedProgram, sqrt
from proofroll.engines.projection.contact.contact_geometry import ContactGeometry
from proofroll.engines.projection.contact.contacts_there import ContactsThere, system_of
from proofroll.engines.projection.contact.slip_directions import SlipDirections
from proofroll.engines.projection.smooth.dependent import DependentCoordinates, quaternion_rates
from proofroll.engines.projection.smooth.elimination import Loads
from proofroll.engines.projection.smooth.recursion import Recursion

_MOST = 8  # bodies and contacts together: with 12 a program costs half of numpy, and 0.1 s to record
RANK = 1e-10  # smallest singular value of independent contact rows, relative to the largest
_INDEPENDENT = 1e-6  # smallest pivot of independent rows, relative to the largest


class InMode(NamedTuple):
    """Motion in a mode at a state.

    Attributes:
        rates: ẏ.
        touching: geometry of the contacts.
        force: on body a of each contact [N], of friction against turning moments [N m], (contacts, 3).
    """

    rates: Array
    touching: Sequence[Touching]
    force: Array


def recordable(mechanism: Mechanism, equations: DependentCoordinates) -> bool:
    """True for a tree of few bodies under weight alone, whose contacts are of spheres, planes and walls by formulas."""
    applied, few = equations.applied, len(mechanism.bodies) + len(mechanism.contacts) <= _MOST
    joints = mechanism.loops or mechanism.couplings or mechanism.prescribed or switched_joints(mechanism)
    forces = mechanism.actuators or applied.laws or applied.of_points or applied.remembers
    return few and not joints and not forces and all(map(_has_formula, mechanism.contacts))


def _has_formula(contact: BodyContact) -> bool:
    shapes = contact.shape_a, contact.shape_b
    if contact.features is not None or contact.box_slot is not None or contact.spinning_friction:
        return False
    walls = [shape for shape in shapes if not isinstance(shape, SphereShape)]
    return len(walls) < len(shapes) and all(map(_is_plain, walls))


def _is_plain(shape: Any) -> bool:
    curved = isinstance(shape, CurvedWall) and shape.has_formula and not isinstance(shape, ConeWall)
    return curved or isinstance(shape, HalfSpace)


class RecordedMode:
    """Equations of motion in a mode as a recorded program.

    The forces that hold closed contacts are solved for outside of it, as their rows may depend on each other.
    """

    def __init__(self, mechanism: Mechanism, mode: ContactMode) -> None:
        """Takes a mechanism that is :func:`recordable`, and a mode without lines of slips."""
        equations = DependentCoordinates(mechanism, Recursion)
        program = RecordedProgram(len(equations.start))
        symbols = np.array(program.symbols, dtype=object)
        self._program = program.arrays(_formulas(equations, mechanism, mode, symbols))
        self._accelerations = slice(7 * len(equations.mass), 13 * len(equations.mass))
        self._slips = [k for k, acting in enumerate(mode) if acting.kind == "slip"]

    def at(self, y: Array, slipping: SlipDirections) -> InMode | None:
        """Motion at a state, the time last; None where a slip has no direction of its own, a wall no normal."""
        try:
            rates, by_unknown, matrix, targets, pushes, gaps, vectors = self._program(y.tolist()[:-1])
        except (ArithmeticError, ValueError):
            return None
        touching = [
            Touching(gap=gap, normal=n, normal_rate=n_rate, place=place, place_rate=place_rate, slide=slide)
            for gap, (n, n_rate, place, place_rate, slide) in zip(gaps.tolist(), vectors, strict=True)
        ]
        if not all(slipping.goes_on(k, slip_velocity(touching[k]).tolist()) for k in self._slips):
            return None
        if self._slips and min(matrix.diagonal().tolist(), default=1.0) <= 0.0:  # torn
            return None
        unknown = _solved(matrix, targets)
        rates[self._accelerations] += by_unknown @ unknown
        return InMode(rates=rates, touching=touching, force=(pushes @ unknown).reshape(-1, 3))


def _formulas(equations: DependentCoordinates, mechanism: Mechanism, mode: ContactMode, x: Array) -> list[Array]:
    """Rates without the unknown forces, accelerations by each, their equations, forces, and geometry of contacts."""
    free, nv = equations.solve(x), equations.nv
    geometry = ContactGeometry(equations, mechanism)
    touching, J, rate = geometry.at(x, free, equations.tree.directions(free.bodies))
    still, drives = np.zeros((3 * len(mode), len(mechanism.joints), 16)), J.reshape(-1, nv)
    by_force = equations.tree.motions(free.bodies, still, Loads(drives=drives))[1]
    response = by_force.T.reshape(nv, *J.shape[:2])
    instant = ContactsThere(touching=touching, J=J, response=response, rate=rate, free=free)
    headings, rows = dict[int, Array](), list[tuple[int, Array]]()
    for k, (acting, contact, point) in enumerate(zip(mode, geometry.contacts, touching, strict=True)):
        if acting.kind == "slip":
            slip = slip_velocity(point)
            headings[k] = slip / sqrt(slip @ slip)
            rows += [(k, point.normal)] * contact.presses
        elif acting.kind == "stick":
            rows += [(k, row) for row in np.eye(3)]  # of friction against turning one of them holds nothing
    system = system_of(instant, geometry.contacts, geometry.friction, headings, rows, rate)
    count, (_, q, v, w) = len(rows), equations.parts(x)
    bodies = [np.concatenate([*map(np.ravel, equations.of_bodies(free.bodies, change))]) for change in system.changes]
    rates = v, quaternion_rates(q, w), free.linear, free.angular, np.ones(1)
    return [
        np.concatenate([part.ravel() for part in rates]),
        np.reshape(bodies, (count, 6 * len(v))).T,
        system.matrix,
        system.targets,
        system.pushes.reshape(count, 3 * len(mode)).T,
        np.array([point.gap for point in touching]),
        np.array([point[1:6] for point in touching]),
    ]


def _solved(A: Array, b: Array) -> Array:
    """Solution of A x = b, of least length where rows depend on each other."""
    from scipy.linalg.lapack import dgesv  # imported here, as balls do not need it

    if not len(b):
        return b
    pivots, _, solution, _ = dgesv(A, b)
    sizes = np.abs(pivots.diagonal()).tolist()
    return np.asarray(solution if min(sizes) > _INDEPENDENT * max(sizes) else np.linalg.lstsq(A, b, rcond=RANK)[0])
