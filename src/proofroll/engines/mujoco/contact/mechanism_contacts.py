"""Contacts of a mechanism: geoms and pairs of an MjSpec, and the contacts that MuJoCo finds, read back.

A vertex is a sphere of almost no radius, a circle a cylinder of almost no height, and a plane on a moving body, which
MuJoCo refuses, the top of a wide box. A curved wall is a plane that :mod:`.walls` poses anew in each step.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import WORLD, Mechanism
from proofroll.elements.mechanism.contact.touching import AT_REST, Moving, touch
from proofroll.elements.mechanism.run.sampling import DEPENDENT
from proofroll.elements.mechanism.scene.rotations import Array, cross, frame_of_axis, to_quaternion
from proofroll.elements.mechanism.scene.shapes.box_features import CORNERS, BoxSlot
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import (
    BoxShape,
    CapsuleShape,
    CircleShape,
    CylinderShape,
    EllipsoidShape,
    HalfSpace,
    Shape,
    SphereShape,
)
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall
from proofroll.engines.mujoco.contact.walls import check_walls, curved_end, shapes_at_start
from proofroll.engines.mujoco.settings import (
    LARGEST_PYRAMIDAL_FRICTION,
    SLIDES,
    TURNS,
    UNBOUNDED_FRICTION,
    MujocoSettings,
)

# m; MuJoCo has no sphere of radius 0.
_VERTEX = 1e-12
# Half the height of a circle's cylinder, as a part of its radius.
_FLAT = 1e-10
# m: half the width and half the depth of the box whose top stands for a plane on a moving body. A sphere that goes
# deeper than it is wide would be pushed out at its side.
_WIDE, _DEEP = 1e3, 1.0
# Gap below which MuJoCo has a contact in its equations: at most 1e-9 m, and no deeper than it pushes with 1e-3 m/s^2.
# At 0, round-off would decide what touches at the start.
_MARGIN, _PUSH = 1e-9, 1e-3
# m: margin within which contacts are searched to be read back, so large that every one is found.
_FAR = 1e6
# Coefficient that stands for unbounded friction beside friction against spin, which MuJoCo makes softer by the square
# of their ratio; a friction of 0.3 N takes 2e-5 of what spin has in their cone.
_BESIDE_SPIN = 50.0
# Factor on rates of the step before, so that their errors open no contact. With twice the rate, contacts that stick
# beside others that slide would swing with a period of two steps.
_LEAD = 1.1
# MuJoCo silently raises a smaller coefficient to this (mjMINMU), unless the contact has no friction at all.
_SMALLEST_FRICTION = 1e-5
# The correction vanishes with the slip, so it may begin a little inside the cone: then all stages of RK4 apply it.
_NEAR_CONE = 1 - 1e-3


def check_contacts(mechanism: Mechanism, settings: MujocoSettings) -> None:
    """Refuses the first contact that MuJoCo would silently change or cannot represent."""
    moving = _moving(mechanism)
    check_walls(mechanism, settings)
    for contact in mechanism.contacts:
        rolling = contact.rolling_resistance if contact.shared_arms else 0.0
        for mu in (_coefficient(contact), contact.spinning_friction, rolling):
            if 0 < mu < _SMALLEST_FRICTION:
                raise Refused(
                    f"MuJoCo raises a coefficient of friction of {mu:g} to {_SMALLEST_FRICTION:g}; 0 is exact"
                )
            if settings.cone == "pyramidal" and mu > LARGEST_PYRAMIDAL_FRICTION:
                limit = f"{LARGEST_PYRAMIDAL_FRICTION:g}"
                raise Refused(f"cone=pyramidal with friction above {limit} makes a contact soft; set cone=elliptic")
        _check_turning(contact)
        sides = ((contact.body_a, contact.shape_a), (contact.body_b, contact.shape_b))
        for (body, shape), (_, partner) in (sides, sides[::-1]):
            if isinstance(shape, HalfSpace) and body in moving and not isinstance(partner, SphereShape):
                raise Refused(
                    f"the plane of {contact.name} moves with {body}; MuJoCo's planes stand, and a box in its place "
                    "meets spheres alone exactly"
                )


def _check_turning(contact: BodyContact) -> None:
    """Raises Refused for friction against turning that MuJoCo's one cone of a contact bounds by another law."""
    if contact.spinning_friction and np.isfinite(contact.friction) and contact.cone == "separate":
        raise Refused(
            f"{contact.name} has friction against spin: in MuJoCo (condim 4) it shares one cone with sliding, and what "
            'one takes the other lacks; the scene bounds each alone; give cone = "shared", or friction = inf'
        )


def write_contacts(spec: Any, bodies: dict[str, Any], mechanism: Mechanism, settings: MujocoSettings) -> None:
    """Adds geoms ``contact<k>a`` and ``contact<k>b`` and a pair for each contact k; no other geoms meet."""
    moving = _moving(mechanism)
    for number, (contact, shapes) in enumerate(zip(mechanism.contacts, shapes_at_start(mechanism), strict=True)):
        if contact.box_slot is not None and contact.slot:
            continue  # the first contact of two boxes stands for all
        names = [f"contact{number}{end}" for end in "ab"]
        for name, body, shape in zip(names, (contact.body_a, contact.body_b), shapes, strict=True):
            geom = bodies[body].add_geom(name=name, mass=0.0, contype=0, conaffinity=0)
            _set_shape(geom, shape, body in moving)
        pair = spec.add_pair(name=f"contact{number}", geomname1=names[0], geomname2=names[1], margin=margin(settings))
        _set_pair_law(pair, contact, settings)


def margin(settings: MujocoSettings) -> float:
    """Gap below which MuJoCo has a contact in its equations [m]; its stiffness is 1/time²."""
    return min(_MARGIN, _PUSH * settings.contact_time**2)


def _set_pair_law(pair: Any, contact: BodyContact, settings: MujocoSettings) -> None:
    """Sets friction, softness and restitution.

    Restitution is one step of damping in solref's direct format: (1 + e)/dt takes away 1 + e times the normal velocity.
    Friction has its own ``solreffriction``, or the slip would be reversed too.
    """
    pair.condim = (TURNS if contact.spinning_friction else SLIDES) if contact.friction else 1
    pair.friction = (_coefficient(contact), _coefficient(contact), contact.spinning_friction, 0.0, 0.0)
    if arms := contact.shared_arms:
        pair.condim, pair.friction[3:] = SLIDES + len(arms), contact.rolling_resistance
    settings.soften(pair)
    if contact.restitution:
        pair.solref = (-1.0, -(1 + contact.restitution) / settings.dt)
        pair.solreffriction = (-1e-9, -1 / settings.dt)


def times_softer(mechanism: Mechanism) -> float:
    """Factor by which the normal rows of contacts that slip or spin are softer in MuJoCo's cone, at most: 1 + mu²."""
    slip = [contact for contact in mechanism.contacts if np.isfinite(contact.friction) or contact.spinning_friction]
    return max((1 + _coefficient(contact) ** 2 for contact in slip), default=1.0)


def _coefficient(contact: BodyContact) -> float:
    """Coefficient of a contact in MuJoCo, which has no unbounded friction."""
    beside_spin = contact.spinning_friction and contact.cone == "separate"
    return min(contact.friction, _BESIDE_SPIN if beside_spin else UNBOUNDED_FRICTION)


def _set_shape(geom: Any, shape: Shape, moves: bool) -> None:
    if isinstance(shape, HalfSpace):
        frame = frame_of_axis(shape.normal)
        geom.quat = to_quaternion(frame)
        if moves:
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_BOX, (_WIDE, _WIDE, _DEEP)
            geom.pos = shape.point - _DEEP * frame[:, 2]
        else:
            geom.type, geom.size, geom.pos = mujoco.mjtGeom.mjGEOM_PLANE, (0.0, 0.0, 1.0), shape.point
        return
    assert not isinstance(shape, CurvedWall)  # planes stand for them
    geom.pos = shape.centre
    if isinstance(shape, SphereShape):
        geom.type, geom.size = mujoco.mjtGeom.mjGEOM_SPHERE, (max(shape.radius, _VERTEX), 0.0, 0.0)
    elif isinstance(shape, EllipsoidShape):
        geom.type, geom.size, geom.quat = mujoco.mjtGeom.mjGEOM_ELLIPSOID, shape.axes, to_quaternion(shape.frame)
    elif isinstance(shape, BoxShape):
        geom.type, geom.size, geom.quat = mujoco.mjtGeom.mjGEOM_BOX, shape.half, to_quaternion(shape.frame)
    elif isinstance(shape, CapsuleShape | CylinderShape):
        kind = "CAPSULE" if isinstance(shape, CapsuleShape) else "CYLINDER"
        geom.type, geom.size = getattr(mujoco.mjtGeom, f"mjGEOM_{kind}"), (shape.radius, shape.half, 0.0)
        geom.quat = to_quaternion(frame_of_axis(shape.axis))
    else:
        assert isinstance(shape, CircleShape)
        geom.type, geom.size = mujoco.mjtGeom.mjGEOM_CYLINDER, (shape.radius, _FLAT * shape.radius, 0.0)
        geom.quat = to_quaternion(frame_of_axis(shape.normal))


def _moving(mechanism: Mechanism) -> frozenset[str]:
    """Names of the bodies that are not fixed to the world."""
    fixed_bodies = {WORLD}
    for joint in mechanism.joints:  # sorted: the parent comes first
        if not joint.nv and joint.parent in fixed_bodies:
            fixed_bodies.add(joint.child)
    return frozenset({body.name for body in mechanism.bodies} - fixed_bodies)


def _in_equations(data: Any) -> list[tuple[Any, int]]:
    """MuJoCo's contacts that have rows in its equations, each with its first one."""
    return [(data.contact[index], row) for index, row in enumerate(data.contact.efc_address.tolist()) if row >= 0]


class ContactsRead(NamedTuple):
    """Contacts as MuJoCo finds them.

    Gaps [m], normals from b to a, places [m], coefficients, of rolling in its cone [m], and the Delassus matrix [1/kg].
    """

    gap: Array
    normal: Array
    place: Array
    friction: Array
    rolling: Array
    restitution: Array
    response: Array


class Contacts:
    """The contacts of a compiled model.

    Attributes:
        boxes: numbers of the first contacts of boxes, whose geoms meet at any of several points.
        of_geom: number of the first contact of each geom, and 1 if the geom is body a's or -1 if it is body b's.
    """

    def __init__(self, model: Any, mechanism: Mechanism, settings: MujocoSettings) -> None:
        self._model, self._mechanism, self._settings = model, mechanism, settings
        firsts = [k - contact.slot if contact.box_slot else k for k, contact in enumerate(mechanism.contacts)]
        self._geoms = [[model.geom(f"contact{k}{end}").id for end in "ab"] for k in firsts]
        self.boxes = {k for k, contact in enumerate(mechanism.contacts) if contact.box_slot and not contact.slot}
        self.of_geom = {a: (k, 1.0) for k, (a, _) in zip(firsts, self._geoms, strict=True)}
        self.of_geom |= {b: (k, -1.0) for k, (_, b) in zip(firsts, self._geoms, strict=True)}
        self._bodies = [
            (model.body(contact.body_a).id, model.body(contact.body_b).id) for contact in mechanism.contacts
        ]
        lag, self._rate = settings.velocity_lag, np.zeros((3, model.nv))
        self._lags = lag, lag + settings.normal_lead, settings.own_share
        self._normal_rows: dict[int, list[Array]] = {}
        curved = {k for k, contact in enumerate(mechanism.contacts) if curved_end(contact) is not None}
        self._turned = curved if settings.curvature else set()
        self._on_cone: set[int] = set()
        self._sticking: set[int] = set()
        self._rates: Array | None = None

    def forces(self, data: Any) -> Array:
        """Forces on body a of each contact in the world [N], shape (contacts, 3)."""
        total, wrench = np.zeros((len(self._geoms), 3)), np.zeros(6)
        for index in range(data.ncon):
            contact = data.contact[index]
            mujoco.mj_contactForce(self._model, data, index, wrench)
            number, sign = self.owner(data, contact)
            # The frame's first axis points from geom[0] to geom[1], and the force is the one on geom[1].
            total[number] += sign * (contact.frame.reshape(3, 3).T @ wrench[:3])
        return total

    def correct(self, data: Any, rows: Array) -> None:
        """Subtracts from the normal rows what lifts contacts in MuJoCo and not in mechanics; the cone must be elliptic.

        Friction in MuJoCo is the dual of a convex cone: friction rows that miss their reference accelerations by r add
        mu r to the normal acceleration, and the contact hops. With the damping b of the slip s, r = b s + ds/dt; ds/dt
        is that of the evaluation before. Where r would be negative, friction ends the slip, and nothing is lifted. The
        second lift is the turning of the normal row (J̇v), which MuJoCo leaves out; it follows from the row of the step
        before (:meth:`remember`). Rates that press a contact instead are left to it.

        Where :meth:`add_curvature` adds J̇v, to be called before, velocities lag, and r is the whole residual of the
        friction rows, of contacts whose force was on the cone in the evaluation before (:meth:`watch`).

        Args:
            data: MuJoCo's data after its reference accelerations and before its forces.
            rows: Jacobian of all rows, shape (nefc, nv).
        """
        dt, rates = self._model.opt.timestep, rows @ data.qacc
        for contact, row in _in_equations(data):
            number = self._number(contact)
            turns = [rows[row] - previous for previous in self._normal_rows.get(number, ())]
            if turns:  # a pair that meets in several points: the nearest row
                turning = float(min(turns, key=np.linalg.norm) @ data.qvel) / dt
                data.efc_aref[row] -= _LEAD * max(turning, 0.0)
            mu, friction = self._slipping(contact)
            if friction.start == friction.stop or number in self._sticking:
                continue
            if number in self._turned:
                if number in self._on_cone:
                    data.efc_aref[row] -= float(np.linalg.norm(mu * (rates[friction] - data.efc_aref[friction])))
                continue
            slips, accelerations = mu * data.efc_vel[friction], mu * rates[friction]
            slip = math.hypot(*slips.tolist())
            # from rest a slip starts along its acceleration
            slip_rates = accelerations if slip == 0 else slips
            size = float(np.linalg.norm(slip_rates))
            rate = float(slip_rates @ accelerations) / size if size else 0.0
            damped = float(data.efc_KBIP[friction.start, 1]) * slip
            if damped + rate > 0:
                data.efc_aref[row] -= damped + _LEAD * max(rate, 0.0)

    def depths(self, data: Any) -> dict[int, float]:
        """Depth at which each contact carries its normal force in ``data``, by number of contact [m].

        With the softness R of a normal row and its force f, the row misses its reference acceleration by R f, which a
        depth adds by K I times itself and the margin.
        """
        depths = dict[int, float]()
        for contact, row in _in_equations(data):
            K, _, impedance, _ = data.efc_KBIP[row].tolist()
            loaded = float(data.efc_R[row] * data.efc_force[row]) / (K * impedance)
            depths[self._number(contact)] = loaded - margin(self._settings)
        return depths

    def _slipping(self, contact: Any) -> tuple[Array, slice]:
        """Coefficients and rows of a contact's friction that may slip: of a pair that never slides, against spin."""
        row, dim, law = int(contact.efc_address), int(contact.dim), self._mechanism.contacts[self._number(contact)]
        first, end = 1, dim if law.cone == "shared" else min(SLIDES, dim)
        if math.isinf(law.friction):
            first, end = SLIDES, max(SLIDES, dim)
        return contact.friction[first - 1 : end - 1], slice(row + first, row + end)

    def watch(self, data: Any) -> None:
        """Keeps which contacts have their force on the cone, and which stick; ``data``: with the last forces.

        Friction of what sticks misses nothing and lifts nothing; rates of the evaluation before would only seem to.
        """
        self._on_cone, within = set[int](), set[int]()
        for contact, row in _in_equations(data):
            mu, friction = self._slipping(contact)
            bound = _NEAR_CONE * data.efc_force[row]
            if bound > 0 and mu.size:
                on_cone = math.hypot(*(data.efc_force[friction] / mu).tolist()) >= bound
                (self._on_cone if on_cone else within).add(self._number(contact))
        self._sticking = within - self._on_cone - self._turned

    def remember(self, data: Any, rows: Array) -> None:
        """Keeps normal rows of a step, and accelerations of that before, for the next one; arguments of correct."""
        self._normal_rows, self._rates = {}, data.qacc.copy()
        for contact, row in _in_equations(data):
            if self._number(contact) not in self._turned:
                self._normal_rows.setdefault(self._number(contact), []).append(rows[row])

    def _number(self, contact: Any) -> int:
        """Number of the mechanism's contact to which MuJoCo's contact belongs."""
        return self.of_geom[int(contact.geom[1])][0]

    def owner(self, data: Any, contact: Any) -> tuple[int, float]:
        """Number of the mechanism's contact that MuJoCo's contact is, and 1 or -1: its force acts on body a or b.

        Of two boxes it is the nearest of their corners and crossings.
        """
        number, sign = self.of_geom[int(contact.geom[1])]
        if number not in self.boxes:
            return number, sign
        contacts, none = self._mechanism.contacts, np.zeros(3)
        slot = contacts[number].box_slot
        assert slot is not None  # as of all of these
        poses = [(data.xpos[body], data.xmat[body].reshape(3, 3)) for body in self._bodies[number]]
        a, b = (Moving(p, R, none, none) for p, R in poses)
        candidates = [touch(contacts[k], a, b) for k in range(number, number + slot.count)]
        away = [
            np.inf if candidate.absent else float(np.linalg.norm(candidate.place - contact.pos))
            for candidate in candidates
        ]
        return number + int(np.argmin(away)), sign

    def add_turning(self, data: Any) -> None:
        """Adds J̇v, which MuJoCo leaves out of the rows of contacts, to the reference accelerations of ``data``."""
        for contact, row in _in_equations(data):
            dim = min(SLIDES, int(contact.dim))
            data.efc_aref[row : row + dim] -= self._turning(data, contact)[:dim]

    def add_curvature(self, data: Any) -> None:
        """Adds J̇v to the rows of curved walls, but for what MuJoCo's damping of velocities that lag supplies.

        To be called like :meth:`correct`. See :attr:`.MujocoSettings.velocity_lag` and those after it.
        """
        contacts = [item for item in _in_equations(data) if self._number(item[0]) in self._turned]
        if not contacts:
            return
        (lag, ahead, share), lagging, turnings = self._lags, data.qvel.copy(), []
        # of the evaluation before, whose direction has turned since: extrapolated
        rates = data.qacc.copy() if self._rates is None else 2 * data.qacc - self._rates
        for time in (lag, ahead):
            data.qvel[:] = lagging + time * rates
            mujoco.mj_comVel(self._model, data)
            turnings.append([self._turning(data, contact) for contact, _ in contacts])
        data.qvel[:] = lagging
        mujoco.mj_comVel(self._model, data)
        for (contact, row), turning, later in zip(contacts, *turnings, strict=True):
            dim = min(SLIDES, int(contact.dim))
            turning[0] = later[0]
            data.efc_aref[row : row + dim] -= (1 - share) * turning[:dim]

    def _turning(self, data: Any, contact: Any) -> Array:
        """J̇v of a contact in its frame [m/s²], for the joint velocities of the last ``mj_comVel``."""
        number, sign = self.owner(data, contact)
        bodies = self._bodies[number]
        movings = [self._moving(data, body) for body in bodies]
        touching, missing = touch(self._mechanism.contacts[number], movings[0], movings[1]), np.zeros(3)
        for body, moving, side in zip(bodies, movings, (1.0, -1.0), strict=True):
            if body:  # the world has no velocity
                mujoco.mj_jacDot(self._model, data, self._rate, None, touching.place, body)
                along_body = touching.place_rate - moving.velocity(touching.place)
                missing += side * (self._rate @ data.qvel + cross(moving.w, along_body))
        shift: Array = sign * contact.frame.reshape(3, 3) @ missing
        shift[0] += float(touching.normal_rate @ touching.slide)
        return shift

    def _moving(self, data: Any, body: int) -> Moving:
        """Motion of a body as of the last computation of velocities."""
        if not body:
            return AT_REST
        twist = np.zeros(6)
        mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_XBODY, body, twist, 0)
        return Moving(data.xpos[body], data.xmat[body].reshape(3, 3), twist[3:], twist[:3])

    def take_lift(self, data: Any, rates: Array) -> None:
        """Subtracts the lift of each contact whose force is on the cone, from the residual of its friction rows.

        :meth:`correct` knows the damping alone; this has the whole residual: acceleration of the row less reference.

        Args:
            data: MuJoCo's data after its forces, whose reference accelerations are edited.
            rates: accelerations of all rows, J q̈, shape (nefc,).
        """
        missed = rates - data.efc_aref
        for contact, row in _in_equations(data):
            mu, friction = self._slipping(contact)
            if np.linalg.norm(data.efc_force[friction] / mu) >= _NEAR_CONE * data.efc_force[row]:
                data.efc_aref[row] -= np.linalg.norm(mu * missed[friction])

    def read(self, data: Any, rows_of: Callable[[Any, int], Array]) -> ContactsRead:
        """All contacts, by MuJoCo's own search with a margin so wide that it finds every one; overwrites ``data``.

        Coefficients are those that MuJoCo combined. ``rows_of(data, n)`` is the Jacobian of the first n rows.
        """
        model, count = self._model, len(self._geoms)
        gap, friction, rolling, restitution = np.full((4, count), np.nan)
        normal, place = np.full((2, count, 3), np.nan)
        rows = np.full((count, 3, model.nv), np.nan)
        kept = int(model.opt.cone), model.pair_margin.copy()
        model.opt.cone, model.pair_margin[:] = mujoco.mjtCone.mjCONE_ELLIPTIC, _FAR  # rows of slips, not of edges
        try:
            mujoco.mj_fwdPosition(model, data)
        finally:
            model.opt.cone, model.pair_margin[:] = kept
        all_rows = rows_of(data, data.nefc)
        for index in range(data.ncon):
            contact = data.contact[index]
            number, sign = self.owner(data, contact)
            if not contact.dist >= gap[number]:  # a cylinder has several contact points: the nearest is taken
                gap[number], normal[number] = contact.dist, sign * contact.frame[:3]
                place[number] = contact.pos + self._to_surface(number) * contact.dist * normal[number]
                row, dim = int(contact.efc_address), min(SLIDES, int(contact.dim))
                damping = float(contact.solref[1])
                friction[number] = contact.friction[0] if dim > 1 else 0.0
                rolling[number] = contact.friction[3] if contact.dim > TURNS else 0.0
                restitution[number] = -damping * model.opt.timestep - 1.0 if damping < 0 else 0.0
                rows[number] = contact.frame.reshape(3, 3)[:dim].T @ all_rows[row : row + dim]
        equality_rows = all_rows[: data.ne]
        whole_rows = np.concatenate([rows.reshape(-1, model.nv), equality_rows])
        to_joints = np.zeros_like(whole_rows)
        mujoco.mj_solveM(model, data, to_joints, whole_rows)
        whole = whole_rows @ to_joints.T
        of, by = slice(0, 3 * count), slice(3 * count, None)
        through_loops = np.linalg.pinv(whole[by, by], DEPENDENT, hermitian=True) @ whole[by, of]
        response = (whole[of, of] - whole[of, by] @ through_loops).reshape(count, 3, count, 3)
        return ContactsRead(
            gap=gap,
            normal=normal,
            place=place,
            friction=friction,
            rolling=rolling,
            restitution=restitution,
            response=response,
        )

    def _to_surface(self, number: int) -> float:
        """Signed half: times the gap, the step along the normal from MuJoCo's contact point to the curved shape."""
        contact = self._mechanism.contacts[number]
        of_second = isinstance(contact.box_slot, BoxSlot) and CORNERS <= contact.slot < 2 * CORNERS  # a corner of it
        return -0.5 if isinstance(contact.shape_a, HalfSpace | CurvedWall) or of_second else 0.5
