"""Accelerations of separate bodies and forces of their rows, of joints and of contacts, by one sparse elimination."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from proofroll.truth.bodies.constraint_rows import ConstraintRow
from proofroll.truth.bodies.maximal_equations import ConstrainedEquations, MaximalEquations
from proofroll.truth.numerics.elimination import Row, eliminated
from proofroll.truth.numerics.scalars import Scalar, sub


class BodySystem:
    """Linear system M u̇ − Cᵀλ − Pᵀz = loads, C u̇ = −bias, K u̇ = aims of bodies in one state, in scalars.

    An armature is a further row with the compliance 1/inertia. Bodies without inertia, whose M is singular, have their
    accelerations eliminated after those rows and before all multipliers: no pivot is zero then, as M plus the drives is
    positive definite.

    Args:
        equations: of the mechanism.
        constrained: these at one state.
        joints: linearly independent rows C that imply all others.
        contacts: rows K, and loads P along u by a unit of each one's force.
        number: of a float as a scalar in whose arithmetic inertias are eliminated: rounded apart, forces and
            accelerations would not fit each other to the last digit of long doubles.
    """

    def __init__(
        self,
        equations: MaximalEquations,
        constrained: ConstrainedEquations,
        joints: Sequence[ConstraintRow],
        contacts: Sequence[tuple[Row, Row]] = (),
        number: Callable[[float], Scalar] = float,
    ) -> None:
        drives, light = [*constrained.drives, *constrained.holders], set(equations.light)
        self._held = [*joints, *(drive.row for drive in drives)]
        self._nu, self._joints, self._first = equations.nu, len(joints), equations.nu + len(self._held)
        pairs = [*((row.coefficients, row.coefficients) for row in self._held), *contacts]
        self._rows: list[Row] = [
            *({k: number(float(value)) for k, value in enumerate(line) if value} for line in equations.mass_matrix),
            *(dict(row) for row, _ in pairs),
        ]
        for place, (_, push) in enumerate(pairs, self._nu):
            for k, value in push.items():
                self._rows[k][place] = value
        for place, drive in enumerate(drives, self._nu + self._joints):
            self._rows[place][place] = -1.0 / number(drive.inertia)
        self._symmetric = all(row is push for row, push in contacts)
        turns = [2 if k in light else 0 for k in range(self._nu)] + [3] * len(joints) + [1] * len(drives)
        turns += [4] * len(contacts)
        self._after = [{j for j in row if turns[j] < turn} for row, turn in zip(self._rows, turns, strict=True)]
        self._after[self._first :] = [set(range(self._first))] * len(contacts)

    def accelerated(
        self, loads: Sequence[Scalar], aims: Sequence[Scalar] = ()
    ) -> tuple[list[Scalar], list[Scalar], list[Scalar], list[Scalar]]:
        """Accelerations u̇, multipliers λ, forces z of contacts, and the pivots of these; ``aims``: of contacts."""
        right = [*loads, *(sub(0.0, row.bias) for row in self._held), *aims]
        (answer,), pivots = eliminated(self._rows, [right], self._after, symmetric=self._symmetric)
        forces = [sub(0.0, value) for value in answer[self._nu :]]
        count = self._first - self._nu
        return answer[: self._nu], forces[: self._joints], forces[count:], pivots[self._first :]

    def pivots(self) -> list[Scalar]:
        """Pivots of the contacts."""
        return eliminated(self._rows, [], self._after, symmetric=self._symmetric)[1][self._first :]

    def responses(self, pushes: Sequence[Row]) -> list[list[Scalar]]:
        """Accelerations by some loads alone, without what velocities bring."""
        rights = [[push.get(k, 0.0) for k in range(len(self._rows))] for push in pushes]
        return [answer[: self._nu] for answer in eliminated(self._rows, rights, self._after, symmetric=True)[0]]
