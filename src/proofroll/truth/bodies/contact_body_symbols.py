"""Route 2 of bodies that touch as symbols: separate bodies, accelerations and forces by one elimination."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from proofroll.elements.mechanism.contact.acting import ContactMode, Features, features_of
from proofroll.elements.mechanism.contact.joint_laws import JointContact
from proofroll.elements.mechanism.contact.turning import TurningFriction
from proofroll.elements.mechanism.scene.kinks import Sides
from proofroll.truth.bodies.constraint_rows import ConstraintRow
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_bodies import AXES, BodyInScalars
from proofroll.truth.bodies.maximal_equations import Drive, Switched
from proofroll.truth.numerics.scalars import Scalar, add, cross, dot, is_zero, minus, mul, plus, scaled, sub, turned
from proofroll.truth.switching.contact_scalars import ScalarMotion, ScalarTouch, floats, known_shapes, touch_in_scalars
from proofroll.truth.switching.contact_symbols import (
    Row,
    SolvedSymbols,
    Vector,
    eliminated,
    kink_guards,
    limited,
    of_joint,
    rows_of,
    worth_compiling,
)
from proofroll.truth.switching.turning_symbols import TurningMoments, of_turning, resisted, resisted_rate


class _Now(NamedTuple):
    """Bodies, rates of joints whose laws are contacts, and what presses each friction of turning, at one instant."""

    views: Sequence[BodyInScalars]
    laws: Sequence[ConstraintRow]
    pressing: Sequence[ScalarTouch] = ()


class BodySymbols:
    """Equations of one mechanism's separate bodies in symbols, for any mode.

    Implements :class:`proofroll.truth.switching.contact_taylor.ModeSymbols`.
    """

    def __init__(self, equations: ContactEquations) -> None:
        self._equations, self._bodies = equations, equations.equations.equations
        self._kept = equations.equations.independent_rows()
        self._touchings = len(equations.mechanism.contacts)
        self._laws = [each for each in equations.contacts if isinstance(each, JointContact)]
        self._frictions = [each for each in equations.contacts if isinstance(each, TurningFriction)]
        self._alone = self._touchings + len(self._laws)  # contacts without friction against turning

    @property
    def covers(self) -> bool:
        """True if all parts of the mechanism have a rule here."""
        bodies = self._bodies
        shapes = all(map(known_shapes, bodies.mechanism.contacts))
        m = bodies.mechanism
        return shapes and worth_compiling(m) and not (bodies.light or m.moved_by_tables)

    def solved(
        self,
        state: Sequence[Scalar],
        mode: ContactMode,
        clamped: Sequence[Scalar],
        began: Sequence[Vector | None],
        functions: Any,
    ) -> SolvedSymbols:
        """Rates and forces for a state that ends with the time; ``began``: line of each contact at the start."""
        e = self._bodies
        kinks = Sides(e.mechanism.kinks, clamped[len(self._equations.limited) :])
        functions = kinks.functions(functions)
        numbers_of_limits = [k for k, actuator in enumerate(e.mechanism.actuators) if actuator.limit is not None]
        limited_ones = [
            (
                k,
                limited(
                    self._wanted(state, k, functions), float(e.mechanism.actuators[k].bound), sign, functions["sqrt"]
                ),
            )
            for k, sign in zip(numbers_of_limits, clamped, strict=False)
        ]
        efforts = {k: effort for k, (effort, _) in limited_ones}
        now = e.at(state[:-1], functions, Switched(clamped=efforts), time=state[-1])
        limits = [*(guard for _, (_, guard) in limited_ones), *kink_guards(kinks)]
        numbers = [law.joint.number for law in self._laws]
        at = _Now(now.views, e.rate_rows(state[:-1], numbers, functions))
        touching = [*self._touching(now.views, features_of(mode), functions), *self._of_joints(state, at)]
        turns = [(friction, touching[friction.pressed_by]) for friction in self._frictions]
        touching += [of_turning(friction, touch, self._relative(friction, at)) for friction, touch in turns]
        at = at._replace(pressing=[touch for _, touch in turns])
        joints = [now.rows[k] for k in self._kept]
        held = [(row.coefficients, row.bias) for row in joints]
        mass = self._mass(now.drives)
        lines = [
            start
            if start is None or self._touchings <= k < self._alone or mode[k].leads
            else self._line(k, touching[k], start, at, (mass, held), functions)
            for k, start in enumerate(began)
        ]
        rows, pushes, aims = [row for row, _ in held], [row for row, _ in held], [sub(0.0, bias) for _, bias in held]
        force = list(now.force)
        for row, inertia in now.drives:
            for n, value in row.coefficients.items():
                force[n] = sub(force[n], mul(inertia, mul(value, row.bias)))
        owner: list[tuple[int, Vector]] = []
        contacts, root = self._equations.contacts, functions["sqrt"]
        turning = TurningMoments(mode, contacts, touching, lines, root)

        def row_of(k: int, direction: Vector) -> Row:
            return self._row(k, touching[k], direction, at)

        for k, (own, touch, line) in enumerate(zip(mode, touching, lines, strict=True)):
            if own.kind == "open":
                continue
            part = rows_of(own.kind, touch, line, contacts[k], root)
            rate = self._bias(k, touch, at)
            if line is not None and own.kind == "slip" and (bound := float(self._equations.bounds[k])):
                for n, value in self._row(k, touch, scaled(-bound, line), at).items():
                    force[n] = add(force[n], value)
            for direction, along in zip(part.directions, part.along, strict=True):
                rows.append(self._row(k, touch, direction, at))
                pushes.append(turning.pushed(self._row(k, touch, along, at), len(owner), k, along, row_of))
                beyond = dot(touch.normal_rate, touch.slide) if own.kind == "slip" else 0.0
                aims.append(sub(sub(0.0, dot(direction, rate)), beyond))
                owner.append((k, along))
        (answer,), pivots = self._eliminated(mass, rows, pushes, [[*force, *aims]])
        response: Scalar = 1.0
        if any(own.kind == "slip" and mu for own, mu in zip(mode, self._equations.friction, strict=True)):
            smooth = self._eliminated(mass, rows, rows, [])[1]
            for one, other in zip(pivots[e.nu :], smooth[e.nu :], strict=True):
                response = mul(response, one / other)
        forces: list[Vector | None] = [None if own.kind == "open" else [0.0, 0.0, 0.0] for own in mode]
        for (k, along), size in zip(owner, answer[e.nu + len(held) :], strict=True):
            own_force = forces[k]
            assert own_force is not None  # its owner is closed
            forces[k] = plus(own_force, scaled(size, along))
        turning.add_to(forces, answer[e.nu + len(held) :])
        moved = [plus(self._moved(k, touch, answer, at), self._bias(k, touch, at)) for k, touch in enumerate(touching)]
        return SolvedSymbols(
            rates=[*now.rate, *answer[: e.nu], *now.angle_rate],
            touching=touching,
            lines=lines,
            forces=forces,
            response=response,
            slide_rates=moved,
            within_limits=limits,
            poses=self._poses(now.views)[:-1],
            efforts=[efforts.get(k, self._wanted(state, k, functions)) for k in range(len(e.mechanism.actuators))],
            drives=None if e.mechanism.prescribed or e.mechanism.loops or e.mechanism.couplings else (),
        )

    def _poses(self, views: Sequence[BodyInScalars]) -> list[tuple[Vector, Sequence[Vector], Vector, Vector]]:
        """Place of its frame, rotation by rows, velocity and angular velocity of each body, and of the world."""
        poses: list[tuple[Vector, Sequence[Vector], Vector, Vector]] = []
        for view, body in zip(views, [*self._bodies.mechanism.bodies, None], strict=True):
            arm = [0.0, 0.0, 0.0] if body is None else turned(view.R, floats(body.com))  # type: ignore[arg-type]
            poses.append((minus(view.r, arm), view.R, minus(view.v, cross(view.w, arm)), view.w))
        return poses

    def _wanted(self, state: Sequence[Scalar], number: int, functions: Any) -> Scalar:
        """Effort of an actuator before it is clamped."""
        e = self._bodies
        actuator = e.mechanism.actuators[number]
        joint = e.mechanism.joint_index[actuator.joint]
        (row,) = e.rate_rows(state[:-1], [joint], functions)
        return actuator.wanted(state[-1], *self._along(state, joint, row), functions)

    def _along(self, state: Sequence[Scalar], joint: int, row: ConstraintRow) -> tuple[Scalar, Scalar]:
        """Coordinate and rate of a joint; angles that are integrated count whole turns."""
        e = self._bodies
        index = next((index for index, (number, _) in enumerate(e.angles) if number == joint), None)
        u = state[e.nx : e.nx + e.nu]
        rate = add(*(mul(value, u[n]) for n, value in row.coefficients.items()))
        return (row.residual if index is None else state[e.nx + e.nu + index]), rate

    def _touching(self, views: Sequence[BodyInScalars], features: Features, functions: Any) -> list[ScalarTouch]:
        bodies = [ScalarMotion(*pose) for pose in self._poses(views)]
        pairs = zip(self._bodies.mechanism.contacts, self._equations.pairs, features, strict=False)
        root = functions["sqrt"]
        return [touch_in_scalars(contact, bodies[a], bodies[b], root, feature) for contact, (a, b), feature in pairs]

    def _of_joints(self, state: Sequence[Scalar], at: _Now) -> list[ScalarTouch]:
        """Laws of joints as contacts."""
        pairs = zip(self._laws, at.laws, strict=True)
        return [of_joint(law, *self._along(state, law.joint.number, row)) for law, row in pairs]

    def _row(self, k: int, touch: ScalarTouch, direction: Vector, now: _Now) -> Row:
        """Coefficients, along the velocities, of a contact's slide in a direction."""
        row: Row = {}
        if k >= self._alone:
            friction, pressing = self._frictions[k - self._alone], now.pressing[k - self._alone]
            way = resisted(friction, pressing, direction)
            for body, sign in zip(self._equations.pairs[friction.pressed_by], (1.0, -1.0), strict=True):
                if body < 0:
                    continue
                entries = self._bodies.bodies[body].projected(now.views[body], [0.0, 0.0, 0.0], scaled(sign, way))
                for at, entry in enumerate(entries, self._bodies.u_slices[body].start):
                    row[at] = add(row.get(at, 0.0), entry)
            return {at: entry for at, entry in row.items() if not is_zero(entry)}
        if k >= self._touchings:
            part = dot(floats(self._laws[k - self._touchings].direction), direction)
            moves = now.laws[k - self._touchings].coefficients
            return {} if is_zero(part) else {n: mul(part, value) for n, value in moves.items()}
        views = now.views
        for body, sign in zip(self._equations.pairs[k], (1.0, -1.0), strict=True):
            if body < 0:
                continue
            arm, way = minus(touch.place, views[body].r), scaled(sign, direction)
            entries = self._bodies.bodies[body].projected(views[body], way, cross(arm, way))
            for at, entry in enumerate(entries, self._bodies.u_slices[body].start):
                row[at] = add(row.get(at, 0.0), entry)
        return {at: entry for at, entry in row.items() if not is_zero(entry)}

    def _relative(self, friction: TurningFriction, now: _Now) -> Vector:
        """Angular velocity of the first body of a contact relative to the second."""
        return minus(*(now.views[body].w for body in self._equations.pairs[friction.pressed_by]))

    def _moved(self, k: int, touch: ScalarTouch, u: Sequence[Scalar], now: _Now) -> list[Scalar]:
        """Slide of a contact by velocities u, or its rate by accelerations."""
        rows = [self._row(k, touch, axis, now) for axis in AXES]
        return [add(*(mul(value, u[at]) for at, value in row.items())) for row in rows]

    def _bias(self, k: int, touch: ScalarTouch, now: _Now) -> Vector:
        """Rate of a contact's slide while the velocities stay."""
        if k >= self._alone:
            friction, pressing = self._frictions[k - self._alone], now.pressing[k - self._alone]
            return resisted_rate(friction, pressing, self._relative(friction, now))
        if k >= self._touchings:
            return scaled(now.laws[k - self._touchings].bias, floats(self._laws[k - self._touchings].direction))
        a, b = (now.views[body] for body in self._equations.pairs[k])
        return minus(*(cross(view.w, minus(touch.place_rate, view.v)) for view in (a, b)))

    def _line(
        self,
        k: int,
        touch: ScalarTouch,
        start: Vector,
        now: _Now,
        bodies: tuple[Sequence[Row], Sequence[tuple[Row, Scalar]]],
        functions: Any,
    ) -> Vector:
        """Present direction of the only line along which a contact can slide: where a force across would move it."""
        push, (mass, held) = self._row(k, touch, touch.across(start), now), bodies
        right = [push.get(at, 0.0) for at in range(self._bodies.nu)] + [0.0] * len(held)
        joints = [row for row, _ in held]
        (answer,), _ = self._eliminated(mass, joints, joints, [right])
        way = touch.across(self._moved(k, touch, answer, now))
        return scaled(1.0 / functions["sqrt"](dot(way, way)), way)

    def _mass(self, drives: Sequence[Drive]) -> list[Row]:
        """Mass matrix with the armature of joints."""
        mass: list[Row] = [
            {j: float(value) for j, value in enumerate(line) if value} for line in self._bodies.mass_matrix
        ]
        for row, inertia in drives:
            for i, value in row.coefficients.items():
                for j, other in row.coefficients.items():
                    mass[i][j] = add(mass[i].get(j, 0.0), mul(inertia, mul(value, other)))
        return mass

    def _eliminated(
        self, mass: Sequence[Row], rows: Sequence[Row], pushes: Sequence[Row], rights: Sequence[Sequence[Scalar]]
    ) -> tuple[list[list[Scalar]], list[Scalar]]:
        """Solutions and pivots of M u̇ − pushesᵀ z = loads, rows u̇ = aims."""
        system: list[Row] = [dict(row) for row in mass]
        for number, push in enumerate(pushes, self._bodies.nu):
            for at, value in push.items():
                system[at][number] = scaled(-1.0, [value])[0]
        return eliminated([*system, *(dict(row) for row in rows)], rights)
