"""Right-hand side and guards of bodies that touch, of one mode, as symbols: what both routes compile.

A route gives its own kinematics and linear system (:class:`ModeSymbols`); guards follow from its solution.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism import WORLD, Mechanism
from proofroll.elements.mechanism.contact.joint_laws import JointContact
from proofroll.elements.mechanism.contact.modes import FAINT, REST, Acting, ContactMode
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.elements.mechanism.contact.touching import FLAT, Moving
from proofroll.elements.mechanism.contact.touching import touch as touch_at
from proofroll.elements.mechanism.scene.kinks import Sides
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.features import Border
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import CircleShape, EllipsoidShape, HalfSpace, SphereShape
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall
from proofroll.truth.numerics.elimination import Row
from proofroll.truth.numerics.scalars import Scalar, add, cross, dot, minus, mul, plus, scaled, sub
from proofroll.truth.switching.contact_guards import LEAST_RESPONSE, NOT_SHARED, TURNED, ContactGuard, Touchable

Vector = Sequence[Scalar]
_MOST_VELOCITIES = 10  # of one tree whose modes are compiled: 8 take a quarter of a second, 12 take eight seconds
_NONE = (0.0, 0.0, 0.0)
# Direction that no normal of a scene has; across a normal it is one in its plane.
_ASIDE = (0.2811, 0.4937, 0.8229)


class ScalarTouch(NamedTuple):
    """A contact at one instant, with plain zeros and ones; see :class:`.Touching`."""

    gap: Scalar
    normal: Vector
    normal_rate: Vector
    place: Vector
    place_rate: Vector
    slide: Vector
    tilt: Scalar = 1.0
    borders: Sequence[Border] = ()

    def across(self, vector: Vector) -> list[Scalar]:
        """Part of a vector along the surfaces."""
        return minus(vector, scaled(dot(self.normal, vector), self.normal))


def scalar_motion(p: Vector, R: Sequence[Vector], v: Vector, w: Vector) -> Moving:
    """Motion of a body: place of its frame, rotation by rows, velocity of the origin, angular velocity; world axes."""
    return Moving(*(np.array(part, dtype=object) for part in (p, R, v, w)))


def touch_in_scalars(contact: BodyContact, a: Moving, b: Moving, feature: int) -> ScalarTouch:
    """Contact at given motions of its bodies; ``feature``: of solids."""
    touching = touch_at(contact, a, b, feature)
    return ScalarTouch(
        gap=touching.gap,
        normal=touching.normal.tolist(),
        normal_rate=touching.normal_rate.tolist(),
        place=touching.place.tolist(),
        place_rate=touching.place_rate.tolist(),
        slide=touching.slide.tolist(),
        tilt=touching.tilt,
        borders=touching.borders,
    )


def floats(vector: Array) -> list[float]:
    """Components as plain floats, so that zeros and ones fold."""
    return [float(x) for x in vector]


def known_shapes(contact: BodyContact) -> bool:
    """True if both shapes have a rule for symbols."""
    rules = SphereShape | EllipsoidShape | CircleShape | HalfSpace | CurvedWall
    shapes = contact.shape_a, contact.shape_b
    simple = all(isinstance(shape, rules) and getattr(shape, "has_formula", True) for shape in shapes)
    return simple or contact.features is not None


def worth_compiling(mechanism: Mechanism) -> bool:
    """True if no tree of bodies has so many velocities that to compile its elimination takes longer than to run it."""
    moves: dict[str, int] = {WORLD: 0}
    root: dict[str, str] = {}
    for joint in mechanism.joints:  # parents come first
        root[joint.child] = joint.child if joint.parent == WORLD else root[joint.parent]
        moves[root[joint.child]] = moves.get(root[joint.child], 0) + joint.nv
    return max(moves.values()) <= _MOST_VELOCITIES


class SolvedSymbols(NamedTuple):
    """Rates and forces of a mode.

    Attributes:
        rates: of the state without the time.
        touching: geometry of each contact.
        lines: present direction of the line of each contact that has one, else None.
        forces: on body a of each contact, (3,); None: open.
        response: Painlevé's measure.
        slide_rates: rate of each sliding velocity, (3,).
        within_limits: guards of efforts with a limit: they reach it, or come back from it; then those of kinks.
        poses: place, rotation by rows, velocity and angular velocity of each body, world axes.
        efforts: of the actuators.
        drives: forces that impose motions, in the order of prescribed joints; None: the route has no rule.
    """

    rates: Sequence[Scalar]
    touching: Sequence[ScalarTouch]
    lines: Sequence[Vector | None]
    forces: Sequence[Vector | None]
    response: Scalar
    slide_rates: Sequence[Vector]
    within_limits: Sequence[Scalar] = ()
    poses: Sequence[tuple[Vector, Sequence[Vector], Vector, Vector]] = ()
    efforts: Sequence[Scalar] = ()
    drives: Sequence[Scalar] | None = ()


def of_joint(contact: JointContact, q: Scalar, v: Scalar) -> ScalarTouch:
    """A law of a joint as a contact, at a coordinate and its rate; see :meth:`JointContact.touching`."""
    return ScalarTouch(
        gap=mul(float(contact.side), sub(q, float(contact.stop))) if contact.side else 0.0,
        normal=(1.0, 0.0, 0.0),
        normal_rate=_NONE,
        place=_NONE,
        place_rate=_NONE,
        slide=scaled(v, floats(contact.direction)),
    )


def limited(effort: Scalar, bound: float, sign: Scalar, root: Callable[[Scalar], Scalar]) -> tuple[Scalar, Scalar]:
    """Effort with a limit, and its guard; ``sign``: of an effort at its limit, 0 of one within, a parameter."""
    within = sub(1.0, mul(sign, sign))
    excess = sub(root(mul(effort, effort)) / bound, 1.0)
    return add(mul(within, effort), mul(sign, bound)), mul(sub(mul(2.0, within), 1.0), excess)


def kink_guards(kinks: Sides) -> list[Scalar]:
    """Guards of kinks of laws, after the evaluation of these with held sides."""
    return [sub(0.0, mul(side, argument)) for side, argument in zip(kinks.held or (), kinks.arguments, strict=True)]


def rows_of(
    kind: str, touch: ScalarTouch, line: Vector | None, contact: Touchable, root: Callable[[Scalar], Scalar]
) -> list[tuple[Vector, Vector]]:
    """Directions of the rows of a closed contact or law of a joint, each with that of the force in it.

    Dry friction of a joint and of turning has no normal; that of a slip is a load that the normal force brings.
    """
    ways: list[Vector] = [touch.normal]
    if contact.bound or contact.pressed_by is not None:
        first = cross(touch.normal, _ASIDE)  # of rolling that stands in its plane
        standing: list[Vector] = [first, cross(touch.normal, first)] if line is None else [line]
        ways = standing if kind == "stick" else []
    elif kind == "stick":
        ways = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)] if line is None else [touch.normal, line]
    elif contact.friction:
        slip = touch.across(touch.slide)
        line = scaled(1.0 / root(dot(slip, slip)), slip) if line is None else line
        return [(touch.normal, minus(touch.normal, scaled(float(contact.friction), line)))]
    return [(way, way) for way in ways]


def guard_symbols(
    guards: Sequence[ContactGuard],
    contacts: Sequence[Touchable],
    solved: SolvedSymbols,
    began: Sequence[Vector | None],
    functions: Mapping[str, Callable[..., Scalar]],
) -> list[Scalar]:
    """Values of guards, as by :func:`proofroll.truth.switching.contact_guards.guard_value` where no load is shared."""

    def size(vector: Vector) -> Scalar:
        return functions["sqrt"](dot(vector, vector))

    def value(guard: ContactGuard) -> Scalar:
        k = guard.contact
        touch, line, force = solved.touching[k], solved.lines[k], solved.forces[k]
        if guard.kind == "pass":
            return touch.borders[guard.border].left_by
        if guard.kind == "turn":
            start = began[k]
            assert line is not None
            assert start is not None
            return sub(TURNED, dot(start, line))
        if guard.kind == "still":
            return sub(FAINT, size(touch.across(touch.slide))) if line is None else sub(0.0, dot(line, touch.slide))
        if guard.kind in {"lift", "break"}:
            assert force is not None  # the contact is closed
            pressed = force if (by := contacts[k].pressed_by) is None else solved.forces[by]
            assert pressed is not None  # with what presses
            normal = dot(touch.normal if by is None else solved.touching[by].normal, pressed)
            if guard.kind == "lift":
                return sub(0.0, normal)
            bound = float(contacts[k].bound) or mul(float(contacts[k].static), normal)
            return sub(size(touch.across(force)), bound)
        plain = {
            "close": sub(0.0, touch.gap),
            "flat": sub(FLAT, touch.tilt),
            "tear": sub(LEAST_RESPONSE, solved.response),
            "share": -REST,
            "grip": NOT_SHARED,
        }
        return plain[guard.kind]

    return [value(guard) for guard in guards]


def slip_symbols(mode: ContactMode, contacts: Sequence[Touchable], solved: SolvedSymbols) -> list[Scalar]:
    """Products u², u·u̇ and u̇² of each slip u in the plane with friction; u² is smooth, also where the slip stops."""
    symbols: list[Scalar] = []
    for acting, contact, touch, rate in zip(mode, contacts, solved.touching, solved.slide_rates, strict=True):
        if turning_slip(acting, contact):
            slip = touch.across(touch.slide)
            symbols += [dot(slip, slip), dot(slip, rate), dot(rate, rate)]
    return symbols


def led_symbols(mode: ContactMode, solved: SolvedSymbols) -> list[Scalar]:
    """Normal, slide and its rate of each contact that leads, which slips against a given direction."""
    symbols: list[Scalar] = []
    for acting, touch, rate in zip(mode, solved.touching, solved.slide_rates, strict=True):
        if acting.leads:
            symbols += [*touch.normal, *touch.slide, *rate]
    return symbols


def stated_symbols(solved: SolvedSymbols) -> list[Scalar]:
    """Record of the checks at a state: poses, then efforts and drives; empty: the route has no rule for a drive."""
    if solved.drives is None:
        return []
    poses = [entry for p, R, v, w in solved.poses for part in (p, *R, v, w) for entry in part]
    return [*poses, *solved.efforts, *solved.drives]


def turning_slip(acting: Acting, contact: Touchable) -> bool:
    """True for a slip in the plane with friction along its own direction, which may turn."""
    return bool(acting.kind == "slip" and acting.along is None and contact.friction and not acting.leads)


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


def lines_of(
    mode: ContactMode,
    contacts: Sequence[Touchable],
    touching: Sequence[ScalarTouch],
    began: Sequence[Vector | None],
    responses: Callable[[list[tuple[int, Vector]]], Sequence[Vector]],
    root: Callable[[Scalar], Scalar],
) -> list[Vector | None]:
    """Present direction of the only line along which each contact can slide: where a force across would move it.

    Those of joints never turn, and those of contacts that lead are given. ``began``: the lines at the start;
    ``responses``: changes of the slides of contacts by unit forces on them in directions.
    """
    lines, turning = list(began), list[tuple[int, Vector]]()
    for k, (acting, contact, touch, start) in enumerate(zip(mode, contacts, touching, began, strict=True)):
        if start is not None and not acting.leads and not isinstance(contact, JointContact):
            turning.append((k, touch.across(start)))
    for (k, _), moved in zip(turning, responses(turning) if turning else (), strict=True):
        way = touching[k].across(moved)
        lines[k] = scaled(1.0 / root(dot(way, way)), way)
    return lines


class UnknownForces:
    """Unknown forces of closed contacts, with the moments of friction against turning that their normal parts bring.

    Attributes:
        rows: coefficients, along the velocities, of the slide in the direction that each has to hold.
        pushes: loads by a unit of each.
        aims: rates of these slides that accelerations have to give.
        owner: contact and direction of each.
    """

    def __init__(
        self,
        mode: ContactMode,
        contacts: Sequence[Touchable],
        touching: Sequence[ScalarTouch],
        lines: Sequence[Vector | None],
        root: Callable[[Scalar], Scalar],
        row_of: Callable[[int, Vector], Row],
        bias_of: Callable[[int], Vector],
    ) -> None:
        """Takes coefficients of a contact's slide in a direction, and its rate while the velocities stay."""
        self._mode, self._touching, self._row_of = mode, touching, row_of
        self._acting = list[tuple[int, int, Vector]]()  # friction, what presses, moment by a unit normal force
        self._found = list[tuple[int, int, Vector]]()
        self.rows, self.pushes, self.aims = list[Row](), list[Row](), list[Scalar]()
        self.owner = list[tuple[int, Vector]]()
        closed = [
            item for item in enumerate(zip(mode, contacts, touching, lines, strict=True)) if item[1][0].kind != "open"
        ]
        for k, (acting, contact, touch, line) in closed:
            if acting.kind == "slip" and contact.pressed_by is not None:
                slip = touch.across(touch.slide)
                way = scaled(1.0 / root(dot(slip, slip)), slip) if line is None else line
                self._acting.append((k, contact.pressed_by, scaled(-float(contact.friction), way)))
        for k, (acting, contact, touch, line) in closed:
            bias, beyond = bias_of(k), dot(touch.normal_rate, touch.slide) if acting.kind == "slip" else 0.0
            for direction, push in rows_of(acting.kind, touch, line, contact, root):
                row = row_of(k, direction)
                self.rows.append(row)
                self.pushes.append(self._pushed(row if push is direction else row_of(k, push), k, push))
                self.aims.append(sub(sub(0.0, dot(direction, bias)), beyond))
                self.owner.append((k, push))

    def _pushed(self, push: Row, k: int, direction: Vector) -> Row:
        """Loads by a unit of the next force, of a contact in a direction, with those of the moments that it brings."""
        for number, by, moment in self._acting:
            if by == k:
                carried = scaled(dot(self._touching[k].normal, direction), moment)
                self._found.append((len(self.owner), number, carried))
                brought = self._row_of(number, carried)
                push = {n: add(push.get(n, 0.0), brought.get(n, 0.0)) for n in (push | brought)}
        return push

    def forces(self, sizes: Sequence[Scalar]) -> list[Vector | None]:
        """Forces and moments of all contacts, from the sizes of the unknown ones; None: open."""
        forces: list[Vector | None] = [None if acting.kind == "open" else [0.0, 0.0, 0.0] for acting in self._mode]
        parts = [(k, scaled(size, push)) for (k, push), size in zip(self.owner, sizes, strict=True)]
        parts += [(k, scaled(sizes[place], moment)) for place, k, moment in self._found]
        for k, part in parts:
            forces[k] = plus(forces[k] or _NONE, part)
        return forces
