"""Route 1 of a mechanism that switches: joint coordinates, Coulomb's law solved for all contacts at once.

In symbols, contact forces follow from their responses alone; velocities of bodies are in their own axes, where those of
a free body are the coordinates' rates themselves.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism.contact.free_slides import FreeSlides
from proofroll.elements.mechanism.contact.joint_laws import JointContact
from proofroll.elements.mechanism.contact.modes import REST, ContactMode, Features, closed_in, features_of
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.elements.mechanism.contact.states import ContactSolution
from proofroll.elements.mechanism.contact.touching import Moving, Touching
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.scene.kinks import Sides
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import value_at
from proofroll.truth.numerics.elimination import Row, eliminated
from proofroll.truth.numerics.hybrid import StretchLaw, Transition
from proofroll.truth.numerics.scalars import (
    Scalar,
    add,
    cross,
    dot,
    is_zero,
    minus,
    mul,
    plus,
    scaled,
    sub,
    turned,
    turned_back,
)
from proofroll.truth.switching.contact_guards import SolvedContacts
from proofroll.truth.switching.contact_stretches import ContactStretches
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
from proofroll.truth.switching.contact_taylor import ModeSymbols
from proofroll.truth.switching.held_route import BodyStates
from proofroll.truth.tree.tree_loads import NONE as _NONE
from proofroll.truth.tree.tree_loads import MovingBody, add_point_loads, bodies_of_tree

_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class _Inertial(NamedTuple):
    """Mass matrix and loads along the velocities, guards of efforts with a limit, efforts.

    ``driven``: velocity that a motion prescribes, with its row of the mass matrix and its load without that.
    """

    mass: list[Row]
    load: list[Scalar]
    limits: list[Scalar]
    efforts: list[Scalar]
    driven: list[tuple[int, Row, Scalar]]


class TreeSymbols:
    """Equations of one mechanism in the coordinates of its tree, in symbols, for any mode.

    Implements :class:`proofroll.truth.switching.contact_taylor.ModeSymbols`.
    """

    def __init__(self, dynamics: ContactDynamics) -> None:
        self._dynamics, self._mechanism = dynamics, dynamics.mechanism
        index = self._mechanism.body_index
        self._pairs = [(index[contact.body_a], index[contact.body_b]) for contact in self._mechanism.contacts]

    @property
    def covers(self) -> bool:
        """True if all parts of the mechanism have a rule here."""
        m = self._mechanism
        shapes = all(map(known_shapes, m.contacts))
        return shapes and worth_compiling(m) and not (m.loops or m.couplings or m.moved_by_tables)

    def solved(
        self,
        state: Sequence[Scalar],
        mode: ContactMode,
        clamped: Sequence[Scalar],
        began: Sequence[Vector | None],
        functions: Any,
    ) -> SolvedSymbols:
        """Rates and forces for a state that ends with the time; ``began``: line of each contact at the start."""
        m = self._mechanism
        kinks = Sides(m.kinks, clamped[len(self._dynamics.equations.limited) :])
        functions = kinks.functions(functions)
        q, v = state[: m.nq], state[m.nq : -1]
        bodies, rates = bodies_of_tree(m, q, v, functions)
        inertial = self._inertial(bodies, q, v, state[-1], clamped, functions)
        mass, load, limits = inertial.mass, inertial.load, inertial.limits
        touching, slides = self._contacts(bodies, q, v, features_of(mode))
        for k, start in enumerate(began[len(m.contacts) :], len(m.contacts)):
            bound = float(self._dynamics.contacts[k].bound)
            if start is not None and mode[k].kind == "slip" and bound:  # dry friction, which is as large as it can be
                for n, value in _along(slides[k][0], scaled(-bound, start)).items():
                    load[n] = add(load[n], value)
        (free,), _ = eliminated(mass, [load])
        contacts, root = self._dynamics.contacts, functions["sqrt"]

        def row_of(k: int, direction: Vector) -> Row:
            return _along(slides[k][0], direction)

        def responses_of(pushes: list[tuple[int, Vector]]) -> list[Vector]:
            answers, _ = eliminated(mass, [self._free(row_of(k, push)) for k, push in pushes])
            return [_moved(slides[k][0], answer) for (k, _), answer in zip(pushes, answers, strict=True)]

        lines = lines_of(mode, contacts, touching, began, responses_of, root)
        unknown = UnknownForces(mode, contacts, touching, lines, root, row_of, lambda k: slides[k][1])
        rows = unknown.rows
        responses, _ = eliminated(mass, [self._free(push) for push in unknown.pushes])
        acting = [_applied(rows, response) for response in responses]
        system: list[Row] = [{j: column[i] for j, column in enumerate(acting)} for i in range(len(rows))]
        right = [sub(aim, value) for aim, value in zip(unknown.aims, _applied(rows, free), strict=True)]
        (sizes,), pivots = eliminated(system, [right])
        response: Scalar = 1.0
        if any(action.kind == "slip" and mu for action, mu in zip(mode, self._dynamics.friction, strict=True)):
            plain, _ = eliminated(mass, [self._free(row) for row in rows])
            smooth = [_applied(rows, column) for column in plain]
            _, others = eliminated([{j: column[i] for j, column in enumerate(smooth)} for i in range(len(rows))], [])
            for pivot, smooth_pivot in zip(pivots, others, strict=True):
                response = mul(response, pivot / smooth_pivot)
        forces, moved = unknown.forces(sizes), list(free)
        for size, column in zip(sizes, responses, strict=True):
            moved = plus(moved, scaled(size, column))
        slide_rates = [plus(_moved(J, moved), bias) for J, bias in slides]
        drives = []
        for n, row, loaded in inertial.driven:
            pushed = [_along(slides[k][0], force).get(n, 0.0) for k, force in enumerate(forces) if force is not None]
            drives.append(sub(_applied([row], moved)[0], add(loaded, *pushed)))
        return SolvedSymbols(
            rates=[*rates, *moved],
            touching=touching,
            lines=lines,
            forces=forces,
            response=response,
            slide_rates=opposed_rates(contacts, touching, slide_rates),
            within_limits=[*limits, *kink_guards(kinks)],
            poses=[(body.p, body.R, turned(body.R, body.v), turned(body.R, body.w)) for body in bodies[:-1]],
            efforts=inertial.efforts,
            drives=drives,
        )

    def _contacts(
        self, bodies: Sequence[MovingBody], q: Sequence[Scalar], v: Sequence[Scalar], features: Features
    ) -> tuple[list[ScalarTouch], list[tuple[dict[int, Vector], Vector]]]:
        """All contacts, and of each slide the derivative by the velocities and the rate at v̇ = 0."""
        m = self._mechanism
        motions = [scalar_motion(body.p, body.R, turned(body.R, body.v), turned(body.R, body.w)) for body in bodies]
        touching = [
            touch_in_scalars(contact, motions[a], motions[b], feature)
            for contact, (a, b), feature in zip(m.contacts, self._pairs, features, strict=False)
        ]
        slides: list[tuple[dict[int, Vector], Vector]] = [
            _slide(touch, [(bodies[a], motions[a], 1.0), (bodies[b], motions[b], -1.0)])
            for touch, (a, b) in zip(touching, self._pairs, strict=True)
        ]
        for contact in self._dynamics.contacts[len(m.contacts) :]:
            if isinstance(contact, TurningFriction):
                pair = self._pairs[contact.pressed_by]
                touch, J, rate = _turning(contact, touching[contact.pressed_by], *(bodies[body] for body in pair))
                touching.append(touch)
                slides.append((J, rate))
                continue
            assert isinstance(contact, JointContact)  # they come after those of bodies
            n = contact.joint.velocity
            touching.append(of_joint(contact, q[contact.joint.coordinate], v[n]))
            slides.append(({n: floats(contact.direction)}, _NONE))
        return touching, slides

    def _inertial(
        self,
        bodies: Sequence[MovingBody],
        q: Sequence[Scalar],
        v: Sequence[Scalar],
        time: Scalar,
        clamped: Sequence[Scalar],
        functions: Any,
    ) -> _Inertial:
        """Mass matrix and loads along the velocities, guards of efforts with a limit, efforts, and what drives move."""
        m = self._mechanism
        mass: list[Row] = [{} for _ in range(m.nv)]
        load: list[Scalar] = [0.0] * m.nv
        gravity = floats(m.gravity)  # type: ignore[arg-type]
        for data, body in zip(m.bodies, bodies, strict=False):
            inertia = [floats(row) for row in data.inertia]  # type: ignore[arg-type]
            move, a = body.at(floats(data.com))  # type: ignore[arg-type]
            pull = scaled(float(data.mass), minus(turned_back(body.R, gravity), a))
            spin = turned(inertia, body.w)
            moment = scaled(-1.0, plus(turned(inertia, body.turning), cross(body.w, spin)))
            for i, way in move.items():
                turn = body.turn.get(i, _NONE)
                load[i] = add(load[i], dot(way, pull), dot(turn, moment))
                carried, turned_by = scaled(float(data.mass), way), turned(inertia, turn)
                for j, factor in move.items():
                    value = add(dot(carried, factor), dot(turned_by, body.turn.get(j, _NONE)))
                    if not is_zero(value):
                        mass[i][j] = add(mass[i].get(j, 0.0), value)
        for joint, at_q, at_v in zip(m.joints, m.q_slices, m.v_slices, strict=True):
            for place, n in enumerate(range(at_v.start, at_v.stop)):
                mass[n][n] = add(mass[n].get(n, 0.0), float(joint.armature or 0.0))
                load[n] = sub(load[n], mul(float(joint.damping or 0.0), v[n]))
                if joint.stiffness:
                    load[n] = sub(load[n], mul(float(joint.stiffness), sub(q[at_q.start + place], float(joint.rest))))
                load[n] = add(load[n], value_at(joint.torque, time, functions))
        limits, efforts = list[Scalar](), list[Scalar]()
        for actuator in m.actuators:
            place, n = m.place_of(actuator.joint)
            effort = actuator.wanted(time, q[place], v[n], functions)
            if actuator.limit is not None:
                effort, guard = limited(effort, float(actuator.bound), clamped[len(limits)], functions["sqrt"])
                limits.append(guard)
            efforts.append(effort)
            load[n] = add(load[n], effort)
        add_point_loads(m, bodies, load, time, functions)
        driven = [(n, mass[n], load[n]) for _, _, n in m.prescribed]
        for joint, _, n in m.prescribed:
            assert joint.motion is not None  # as of all prescribed ones
            mass[n], load[n] = {n: 1.0}, moved(joint.motion, time, functions).acceleration
        return _Inertial(mass=mass, load=load, limits=limits, efforts=efforts, driven=driven)

    def _free(self, row: Row) -> list[Scalar]:
        """Loads along the velocities; those along prescribed ones move nothing."""
        prescribed = {n for _, _, n in self._mechanism.prescribed}
        return [0.0 if n in prescribed else row.get(n, 0.0) for n in range(self._mechanism.nv)]


def _slide(touch: ScalarTouch, pair: Sequence[tuple[MovingBody, Moving, float]]) -> tuple[dict[int, Vector], Vector]:
    """Derivative of a contact's slide by the velocities, and its rate at v̇ = 0, in world axes."""
    J: dict[int, Vector] = {}
    rate: Vector = _NONE
    for body, motion, sign in pair:
        arm = minus(touch.place, motion.p.tolist())
        move, _ = body.at(turned_back(body.R, arm))
        for n, way in move.items():
            J[n] = plus(J.get(n, _NONE), scaled(sign, turned(body.R, way)))
        turning = plus(turned(body.R, body.a), cross(turned(body.R, body.turning), arm))
        drift = cross(motion.w.tolist(), minus(touch.place_rate, motion.v.tolist()))
        rate = plus(rate, scaled(sign, plus(turning, drift)))
    return J, rate


def _turning(
    friction: TurningFriction, touch: ScalarTouch, a: MovingBody, b: MovingBody
) -> tuple[ScalarTouch, dict[int, Vector], Vector]:
    """Friction against turning as a contact, its slide's derivative by the velocities, and its rate at v̇ = 0."""
    J: dict[int, Vector] = {}
    turning, rate = (
        minus(*(turned(body.R, part) for body, part in of))
        for of in (((a, a.w), (b, b.w)), ((a, a.turning), (b, b.turning)))
    )
    for body, sign in ((a, 1.0), (b, -1.0)):
        for n, way in body.turn.items():
            J[n] = plus(J.get(n, _NONE), scaled(sign, turned(body.R, way)))
    J = {n: resisted(friction, touch, way) for n, way in J.items()}
    rate = plus(resisted(friction, touch, rate), resisted_rate(friction, touch, turning))
    return of_turning(friction, touch, turning), J, rate


def _moved(J: dict[int, Vector], v: Sequence[Scalar]) -> list[Scalar]:
    return [add(*(mul(value[axis], v[n]) for n, value in J.items())) for axis in range(3)]


def _along(J: dict[int, Vector], direction: Vector) -> Row:
    values = {n: dot(way, direction) for n, way in J.items()}
    return {n: value for n, value in values.items() if not is_zero(value)}


def _applied(rows: Sequence[Row], vector: Sequence[Scalar]) -> list[Scalar]:
    return [add(*(mul(value, vector[n]) for n, value in row.items())) for row in rows]


class ContactTree(ContactStretches):
    """Stretches of a mechanism in the coordinates of its tree.

    Implements :class:`proofroll.truth.numerics.hybrid.HybridRoute`.
    """

    _begins_by, _by_collocation = 15, True

    def __init__(self, dynamics: ContactDynamics, tolerance: float, size: float) -> None:
        self.dynamics = dynamics
        dynamics.equations.record()
        super().__init__(dynamics, dynamics.mechanism.nq + dynamics.mechanism.nv, tolerance, size)

    def _symbols(self) -> ModeSymbols:
        return TreeSymbols(self.dynamics)

    @property
    def start(self) -> Array:
        """State at time 0."""
        return np.append(np.concatenate(self.dynamics.mechanism.start()), 0.0)

    def bodies(self, state: Array) -> BodyStates:
        """Places, velocities, quaternions and angular velocities of all bodies, world axes."""
        motion = self.dynamics.equations.tree.at(*self.dynamics.parts(state)[:2])
        turned = Rotation.from_matrix(motion.R_WB[:-1]).as_quat(scalar_first=True)
        return motion.p_WB[:-1], motion.v_WB[:-1], turned, motion.w_WB[:-1]

    def _law(self, state: Array, mode: ContactMode, signs: tuple[int, ...] | None = None) -> StretchLaw:
        law = super()._law(state, mode, signs)
        return law._replace(corrected=self.dynamics.equations.watching(law.corrected))

    def _law_inside(self, state: Array, mode: ContactMode) -> StretchLaw:
        return super()._law(state, mode)

    def begin(self) -> Transition[ContactMode]:
        """See the protocol."""
        rough = self._moved_on(self.start, self.dynamics.rough_start())
        mode, margin = self.decided(self.start, rough)
        state = self.dynamics.eliminated(self.start, mode)
        return Transition(state, mode, (), margin)

    def _struck(
        self, state: Array, rough: ContactMode, laws: Sequence[float], sideways: Sequence[float]
    ) -> tuple[Array, list[bool], float]:
        (q, v, time), features, closed_mask = self.dynamics.parts(state), features_of(rough), closed_in(rough)
        which = np.flatnonzero(closed_mask).tolist()
        normal, tangential = (np.array([law[k] for k in which]) for law in (laws, sideways))
        velocity, impulse, margin = self.dynamics.struck(q, v, which, normal, time, tangential, features)
        stays, touching = list(closed_mask), self.dynamics.at(q, velocity, time, features).touching
        for pressed, k in zip(impulse[:, 0] > 0, which, strict=True):
            leaves = float(touching[k].normal @ touching[k].slide) > REST
            stays[k] = not laws[k] if pressed else not leaves
        return np.concatenate([q, velocity, [time]]), stays, margin

    def _forces(self, state: Array, mode: ContactMode) -> ContactSolution:
        q, v, time = self.dynamics.parts(state)
        return self.dynamics.solve(q, v, mode, time)

    def _touching(self, state: Array, features: Features | None) -> Sequence[Touching]:
        return self.dynamics.at(*self.dynamics.parts(state), features).touching

    def _solution(self, state: Array, mode: ContactMode) -> SolvedContacts:
        solution, v = self._forces(state, mode), self.dynamics.parts(state)[1]
        return SolvedContacts(
            touching=solution.state.touching,
            mode=solution.mode,
            velocity=v,
            acceleration=solution.acceleration,
            slide_rate=solution.slide_rate,
            force=solution.force,
            response=solution.response,
            splits=solution.splits,
            spread=solution.spread,
            shifts=solution.shifts,
        )

    def _free_slides(self, state: Array, rough: ContactMode) -> FreeSlides:
        q, v, time = self.dynamics.parts(state)
        return self.dynamics.at(q, v, time, features_of(rough)).free_slides

    def _decided(self, state: Array, rough: ContactMode, leaving: Sequence[int] = ()) -> tuple[ContactMode, float]:
        q, v, time = self.dynamics.parts(state)
        return self.dynamics.decided(q, v, rough, time, leaving)
