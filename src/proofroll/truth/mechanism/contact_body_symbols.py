"""Route 2 of bodies that touch as symbols: separate bodies, accelerations and forces by one elimination."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from proofroll.elements.mechanism.contacts.acting import ContactMode
from proofroll.elements.mechanism.contacts.geometry import BodyContact
from proofroll.elements.mechanism.signal import Table
from proofroll.truth.mechanism.contact_equations import ContactEquations
from proofroll.truth.mechanism.contact_scalars import ScalarMotion, ScalarTouch, floats, known_shapes, touch_in_scalars
from proofroll.truth.mechanism.contact_symbols import Row, SolvedSymbols, Vector, eliminated, held_rows
from proofroll.truth.mechanism.maximal_bodies import AXES, BodyInScalars
from proofroll.truth.mechanism.maximal_equations import ConstrainedEquations
from proofroll.truth.scalars import Scalar, add, cross, dot, is_zero, minus, mul, plus, scaled, sub, turned


class BodySymbols:
    """Equations of one mechanism's separate bodies in symbols, for any mode.

    Implements :class:`proofroll.truth.mechanism.contact_taylor.ModeSymbols`.
    """

    def __init__(self, equations: ContactEquations) -> None:
        self._equations, self._bodies = equations, equations.equations.equations
        self._kept = equations.equations.independent_rows()

    @property
    def covers(self) -> bool:
        """True if all parts of the mechanism have a rule here."""
        contacts, bodies = self._equations.contacts, self._bodies
        shapes = all(isinstance(contact, BodyContact) and known_shapes(contact) for contact in contacts)
        laws = any(joint.armature for joint in bodies.mechanism.joints) or any(
            actuator.limit is not None for actuator in bodies.mechanism.actuators
        )
        tables = any(isinstance(signal, Table) for signal in bodies.mechanism.signals)
        return shapes and not bodies.light and not laws and not tables

    def solved(
        self, state: Sequence[Scalar], mode: ContactMode, began: Sequence[Vector | None], functions: Any
    ) -> SolvedSymbols:
        """Rates and forces for a state that ends with the time; ``began``: line of each contact at the start."""
        e = self._bodies
        now = e.at(state[:-1], functions, time=state[-1])
        touching = self._touching(now.views, functions)
        joints = [now.rows[k] for k in self._kept]
        held = [(row.coefficients, row.bias) for row in joints]
        lines = [
            None if start is None else self._line(k, touching[k], start, now, held, functions)
            for k, start in enumerate(began)
        ]
        rows, pushes, aims = [row for row, _ in held], [row for row, _ in held], [sub(0.0, bias) for _, bias in held]
        owner: list[tuple[int, Vector]] = []
        for k, (own, touch, line) in enumerate(zip(mode, touching, lines, strict=True)):
            if own.kind == "open":
                continue
            part = held_rows(own.kind, touch, line, float(self._equations.friction[k]), functions["sqrt"])
            rate = self._bias(k, touch, now.views)
            for direction, along in zip(part.directions, part.along, strict=True):
                rows.append(self._row(k, touch, direction, now.views))
                pushes.append(self._row(k, touch, along, now.views))
                turning = dot(touch.normal_rate, touch.slide) if own.kind == "slip" else 0.0
                aims.append(sub(sub(0.0, dot(direction, rate)), turning))
                owner.append((k, along))
        (answer,), pivots = self._eliminated(rows, pushes, [[*now.force, *aims]])
        response: Scalar = 1.0
        if any(own.kind == "slip" and mu for own, mu in zip(mode, self._equations.friction, strict=True)):
            smooth = self._eliminated(rows, rows, [])[1]
            for one, other in zip(pivots[e.nu :], smooth[e.nu :], strict=True):
                response = mul(response, one / other)
        forces: list[Vector | None] = [None if own.kind == "open" else [0.0, 0.0, 0.0] for own in mode]
        for (k, along), size in zip(owner, answer[e.nu + len(held) :], strict=True):
            force = forces[k]
            assert force is not None  # its owner is closed
            forces[k] = plus(force, scaled(size, along))
        moved = [
            plus(self._moved(k, touch, answer, now.views), self._bias(k, touch, now.views))
            for k, touch in enumerate(touching)
        ]
        return SolvedSymbols([*now.rate, *answer[: e.nu], *now.angle_rate], touching, lines, forces, response, moved)

    def _touching(self, views: Sequence[BodyInScalars], functions: Any) -> list[ScalarTouch]:
        bodies = []
        for view, body in zip(views, [*self._bodies.mechanism.bodies, None], strict=True):
            arm = [0.0, 0.0, 0.0] if body is None else turned(view.R, floats(body.com))  # type: ignore[arg-type]
            bodies.append(ScalarMotion(minus(view.r, arm), view.R, minus(view.v, cross(view.w, arm)), view.w))
        pairs = zip(self._bodies.mechanism.contacts, self._equations.pairs, strict=True)
        return [touch_in_scalars(contact, bodies[a], bodies[b], functions["sqrt"]) for contact, (a, b) in pairs]

    def _row(self, k: int, touch: ScalarTouch, direction: Vector, views: Sequence[BodyInScalars]) -> Row:
        """Coefficients, along the velocities, of a contact's slide in a direction."""
        row: Row = {}
        for body, sign in zip(self._equations.pairs[k], (1.0, -1.0), strict=True):
            if body < 0:
                continue
            arm, way = minus(touch.place, views[body].r), scaled(sign, direction)
            entries = self._bodies.bodies[body].projected(views[body], way, cross(arm, way))
            for at, entry in enumerate(entries, self._bodies.u_slices[body].start):
                row[at] = add(row.get(at, 0.0), entry)
        return {at: entry for at, entry in row.items() if not is_zero(entry)}

    def _moved(self, k: int, touch: ScalarTouch, u: Sequence[Scalar], views: Sequence[BodyInScalars]) -> list[Scalar]:
        """Slide of a contact by velocities u, or its rate by accelerations."""
        rows = [self._row(k, touch, axis, views) for axis in AXES]
        return [add(*(mul(value, u[at]) for at, value in row.items())) for row in rows]

    def _bias(self, k: int, touch: ScalarTouch, views: Sequence[BodyInScalars]) -> Vector:
        """Rate of a contact's slide while the velocities stay."""
        a, b = (views[body] for body in self._equations.pairs[k])
        return minus(*(cross(view.w, minus(touch.place_rate, view.v)) for view in (a, b)))

    def _line(
        self,
        k: int,
        touch: ScalarTouch,
        start: Vector,
        now: ConstrainedEquations,
        held: Sequence[tuple[Row, Scalar]],
        functions: Any,
    ) -> Vector:
        """Present direction of the only line along which a contact can slide: where a force across would move it."""
        push = self._row(k, touch, touch.across(start), now.views)
        right = [push.get(at, 0.0) for at in range(self._bodies.nu)] + [0.0] * len(held)
        joints = [row for row, _ in held]
        (answer,), _ = self._eliminated(joints, joints, [right])
        way = touch.across(self._moved(k, touch, answer, now.views))
        return scaled(1.0 / functions["sqrt"](dot(way, way)), way)

    def _eliminated(
        self, rows: Sequence[Row], pushes: Sequence[Row], rights: Sequence[Sequence[Scalar]]
    ) -> tuple[list[list[Scalar]], list[Scalar]]:
        """Solutions and pivots of M u̇ − pushesᵀ z = loads, rows u̇ = aims."""
        nu = self._bodies.nu
        system: list[Row] = [
            {j: float(value) for j, value in enumerate(line) if value} for line in self._bodies.mass_matrix
        ]
        for number, push in enumerate(pushes, nu):
            for at, value in push.items():
                system[at][number] = scaled(-1.0, [value])[0]
        return eliminated([*system, *(dict(row) for row in rows)], rights)
