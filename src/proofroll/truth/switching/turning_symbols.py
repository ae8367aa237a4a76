"""Friction of a contact against turning, in symbols: what both routes compile of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.truth.numerics.elimination import Row
from proofroll.truth.numerics.scalars import Scalar, add, cross, dot, minus, plus, scaled
from proofroll.truth.switching.contact_guards import Touchable
from proofroll.truth.switching.contact_symbols import ScalarTouch

Vector = Sequence[Scalar]
_NONE = (0.0, 0.0, 0.0)


def of_turning(friction: TurningFriction, touch: ScalarTouch, turning: Vector) -> ScalarTouch:
    """Friction against turning as a contact; see :meth:`.TurningFriction.touching`.

    A spin is a slide along the normal, across none.
    """
    slide = resisted(friction, touch, turning)
    if friction.bend:
        slide = plus(slide, scaled(friction.bend, cross(touch.normal, touch.slide)))
    if not friction.spins:
        return touch._replace(slide=slide, tilt=1.0)
    return touch._replace(normal=_NONE, normal_rate=_NONE, slide=slide, tilt=1.0)


def resisted(friction: TurningFriction, touch: ScalarTouch, vector: Vector) -> Vector:
    """Part of an angular velocity, or of its rate, that a friction resists."""
    part = scaled(dot(touch.normal, vector), touch.normal)
    return part if friction.spins else minus(vector, part)


def resisted_rate(friction: TurningFriction, touch: ScalarTouch, turning: Vector) -> Vector:
    """Rate of the resisted part of an angular velocity as the normal turns."""
    n, rate = touch.normal, touch.normal_rate
    turned = plus(scaled(dot(n, turning), rate), scaled(dot(rate, turning), n))
    if not friction.bend:
        return turned if friction.spins else scaled(-1.0, turned)
    return minus(scaled(friction.bend, cross(rate, touch.slide)), turned)


def opposed_rates(
    contacts: Sequence[Touchable], touching: Sequence[ScalarTouch], rates: Sequence[Vector]
) -> list[Vector]:
    """Rates of all slides from these and the rates of turning that friction resists; see :meth:`.opposed`."""
    whole = list(rates)
    for k, contact in enumerate(contacts):
        if isinstance(contact, TurningFriction) and contact.bend:
            slide = cross(touching[contact.pressed_by].normal, rates[contact.pressed_by])
            whole[k] = plus(rates[k], scaled(contact.bend, slide))
    return whole


class TurningMoments:
    """Moments of friction against turning that the normal forces of contacts bring."""

    def __init__(
        self,
        mode: ContactMode,
        contacts: Sequence[Touchable],
        touching: Sequence[ScalarTouch],
        lines: Sequence[Vector | None],
        root: Callable[[Scalar], Scalar],
    ) -> None:
        self._touching, self._found = touching, list[tuple[int, int, Vector]]()
        self._acting: list[tuple[int, int, Vector]] = []  # friction, what presses, moment by a unit normal force
        for k, (acting, contact, touch, line) in enumerate(zip(mode, contacts, touching, lines, strict=True)):
            if acting.kind != "slip" or contact.pressed_by is None:
                continue
            slip = touch.across(touch.slide)
            way = scaled(1.0 / root(dot(slip, slip)), slip) if line is None else line
            self._acting.append((k, contact.pressed_by, scaled(-float(contact.friction), way)))

    def pushed(self, push: Row, place: int, k: int, direction: Vector, row_of: Callable[[int, Vector], Row]) -> Row:
        """Loads by a unit of an unknown force, with those of the moments that it brings.

        Args:
            push: loads of the force alone.
            place: of the force among all unknown ones.
            k: its contact.
            direction: its direction.
            row_of: coefficients of a contact's slide in a direction.
        """
        for number, by, moment in self._acting:
            if by == k:
                carried = scaled(dot(self._touching[k].normal, direction), moment)
                self._found.append((place, number, carried))
                brought = row_of(number, carried)
                push = {n: add(push.get(n, 0.0), brought.get(n, 0.0)) for n in (push | brought)}
        return push

    def add_to(self, forces: list[Vector | None], sizes: Sequence[Scalar]) -> None:
        """Adds the moments to the forces of all contacts, from the sizes of the unknown ones."""
        for place, k, moment in self._found:
            forces[k] = plus(forces[k] or _NONE, scaled(sizes[place], moment))
