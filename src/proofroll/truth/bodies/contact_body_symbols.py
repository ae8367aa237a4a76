"""Route 2 of bodies that touch as symbols: separate bodies, accelerations and forces by one elimination."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from proofroll.elements.mechanism.contact.joint_laws import JointContact
from proofroll.elements.mechanism.contact.modes import ContactMode, Features, features_of
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.elements.mechanism.scene.kinks import Sides
from proofroll.truth.bodies.constraint_rows import ConstraintRow
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_bodies import AXES, BodyInScalars
from proofroll.truth.bodies.maximal_equations import Switched
from proofroll.truth.bodies.maximal_taylor import BodySystem
from proofroll.truth.numerics.elimination import Row
from proofroll.truth.numerics.scalars import Scalar, add, cross, dot, is_zero, minus, mul, plus, scaled, turned
from proofroll.truth.switching.contact_symbols import (
    ScalarTouch,
    SolvedSymbols,
    UnknownForces,
    Vector,
    floats,
    kink_guards,
    known_shapes,
    limited,
    lines_of,
    of_joint,
    of_turning,
    opposed_rates,
    resisted,
    resisted_rate,
    scalar_motion,
    touch_in_scalars,
    worth_compiling,
)


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
        self._kept = list(equations.equations.independent_rows())
        self._moved_alone = equations.equations.moved_alone()
        self._touchings = len(equations.mechanism.contacts)
        self._laws = [contact for contact in equations.contacts if isinstance(contact, JointContact)]
        self._frictions = [contact for contact in equations.contacts if isinstance(contact, TurningFriction)]
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
        efforts, limits = dict[int, Scalar](), list[Scalar]()
        limited_ones = (k for k, actuator in enumerate(e.mechanism.actuators) if actuator.limit is not None)
        for k, sign in zip(limited_ones, clamped, strict=False):
            bound = float(e.mechanism.actuators[k].bound)
            efforts[k], guard = limited(self._wanted(state, k, functions), bound, sign, functions["sqrt"])
            limits.append(guard)
        motion = e.at(state[:-1], functions, Switched(clamped=efforts), time=state[-1])
        numbers = [law.joint.number for law in self._laws]
        instant = _Now(motion.views, e.rate_rows(state[:-1], numbers, functions))
        touching = [*self._touching(motion.views, features_of(mode)), *self._of_joints(state, instant)]
        turns = [(friction, touching[friction.pressed_by]) for friction in self._frictions]
        touching += [of_turning(friction, touch, self._relative(friction, instant)) for friction, touch in turns]
        instant = instant._replace(pressing=[touch for _, touch in turns])
        joints = [motion.rows[k] for k in self._kept]
        contacts, force, root = self._equations.contacts, list(motion.force), functions["sqrt"]

        def row_of(k: int, direction: Vector) -> Row:
            return self._row(k, touching[k], direction, instant)

        def responses_of(pushes: list[tuple[int, Vector]]) -> list[Vector]:
            answers = BodySystem(e, motion, joints).responses([row_of(k, push) for k, push in pushes])
            return [
                self._moved(k, touching[k], answer, instant) for (k, _), answer in zip(pushes, answers, strict=True)
            ]

        lines = lines_of(mode, contacts, touching, began, responses_of, root)
        for k, (acting, touch, line) in enumerate(zip(mode, touching, lines, strict=True)):
            if line is not None and acting.kind == "slip" and (bound := float(self._equations.bounds[k])):
                for n, value in self._row(k, touch, scaled(-bound, line), instant).items():
                    force[n] = add(force[n], value)
        unknown = UnknownForces(
            mode, contacts, touching, lines, root, row_of, lambda k: self._bias(k, touching[k], instant)
        )
        system = BodySystem(e, motion, joints, list(zip(unknown.rows, unknown.pushes, strict=True)))
        accelerations, multipliers, sizes, pivots = system.accelerated(force, unknown.aims)
        response: Scalar = 1.0
        if any(acting.kind == "slip" and mu for acting, mu in zip(mode, self._equations.friction, strict=True)):
            smooth = BodySystem(e, motion, joints, [(row, row) for row in unknown.rows]).pivots()
            for pivot, smooth_pivot in zip(pivots, smooth, strict=True):
                response = mul(response, pivot / smooth_pivot)
        moved = [
            plus(self._moved(k, touch, accelerations, instant), self._bias(k, touch, instant))
            for k, touch in enumerate(touching)
        ]
        return SolvedSymbols(
            rates=[*motion.rate, *accelerations, *motion.angle_rate],
            touching=touching,
            lines=lines,
            forces=unknown.forces(sizes),
            response=response,
            slide_rates=opposed_rates(contacts, touching, moved),
            within_limits=[*limits, *kink_guards(kinks)],
            poses=self._poses(motion.views)[:-1],
            efforts=motion.efforts,
            drives=self._drives(motion.moved, multipliers),
        )

    def _drives(self, moved: slice, multipliers: Sequence[Scalar]) -> list[Scalar] | None:
        """Forces that impose motions; None where independent rows do not determine them, or of loops and couplings."""
        e, rows = self._bodies, range(moved.start, moved.stop)
        if e.mechanism.loops or e.mechanism.couplings or not (set(rows) <= set(self._kept) and self._moved_alone):
            return None
        return [multipliers[self._kept.index(row)] for row in rows]

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

    def _touching(self, views: Sequence[BodyInScalars], features: Features) -> list[ScalarTouch]:
        bodies = [scalar_motion(*pose) for pose in self._poses(views)]
        pairs = zip(self._bodies.mechanism.contacts, self._equations.pairs, features, strict=False)
        return [touch_in_scalars(contact, bodies[a], bodies[b], feature) for contact, (a, b), feature in pairs]

    def _of_joints(self, state: Sequence[Scalar], instant: _Now) -> list[ScalarTouch]:
        """Laws of joints as contacts."""
        pairs = zip(self._laws, instant.laws, strict=True)
        return [of_joint(law, *self._along(state, law.joint.number, row)) for law, row in pairs]

    def _row(self, k: int, touch: ScalarTouch, direction: Vector, instant: _Now) -> Row:
        """Coefficients, along the velocities, of a contact's slide in a direction."""
        row: Row = {}
        if k >= self._alone:
            friction, pressing = self._frictions[k - self._alone], instant.pressing[k - self._alone]
            way = resisted(friction, pressing, direction)
            for body, sign in zip(self._equations.pairs[friction.pressed_by], (1.0, -1.0), strict=True):
                if body < 0:
                    continue
                entries = self._bodies.bodies[body].projected(instant.views[body], [0.0, 0.0, 0.0], scaled(sign, way))
                for column, entry in enumerate(entries, self._bodies.u_slices[body].start):
                    row[column] = add(row.get(column, 0.0), entry)
            return {column: entry for column, entry in row.items() if not is_zero(entry)}
        if k >= self._touchings:
            part = dot(floats(self._laws[k - self._touchings].direction), direction)
            moves = instant.laws[k - self._touchings].coefficients
            return {} if is_zero(part) else {n: mul(part, value) for n, value in moves.items()}
        views = instant.views
        for body, sign in zip(self._equations.pairs[k], (1.0, -1.0), strict=True):
            if body < 0:
                continue
            arm, way = minus(touch.place, views[body].r), scaled(sign, direction)
            entries = self._bodies.bodies[body].projected(views[body], way, cross(arm, way))
            for column, entry in enumerate(entries, self._bodies.u_slices[body].start):
                row[column] = add(row.get(column, 0.0), entry)
        return {column: entry for column, entry in row.items() if not is_zero(entry)}

    def _relative(self, friction: TurningFriction, instant: _Now) -> Vector:
        """Angular velocity of the first body of a contact relative to the second."""
        return minus(*(instant.views[body].w for body in self._equations.pairs[friction.pressed_by]))

    def _moved(self, k: int, touch: ScalarTouch, u: Sequence[Scalar], instant: _Now) -> list[Scalar]:
        """Slide of a contact by velocities u, or its rate by accelerations."""
        rows = [self._row(k, touch, axis, instant) for axis in AXES]
        return [add(*(mul(value, u[column]) for column, value in row.items())) for row in rows]

    def _bias(self, k: int, touch: ScalarTouch, instant: _Now) -> Vector:
        """Rate of a contact's slide while the velocities stay."""
        if k >= self._alone:
            friction, pressing = self._frictions[k - self._alone], instant.pressing[k - self._alone]
            return resisted_rate(friction, pressing, self._relative(friction, instant))
        if k >= self._touchings:
            return scaled(instant.laws[k - self._touchings].bias, floats(self._laws[k - self._touchings].direction))
        a, b = (instant.views[body] for body in self._equations.pairs[k])
        return minus(*(cross(view.w, minus(touch.place_rate, view.v)) for view in (a, b)))
