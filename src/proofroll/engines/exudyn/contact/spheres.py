"""Formulation ``spheres``: bodies of :mod:`redundant` with Exudyn's penalty contacts of spheres.

A sphere meets a plane as ``ObjectContactSphereTriangle``, with a triangle so wide that its edges are out of reach, and
another sphere as ``ObjectContactSphereSphere``, a curved wall as a hollow one (:mod:`.hollow_spheres`). Friction is
proportional to the slip up to ``friction_zone`` and Coulomb's beyond, in the direction of the slip: a contact that
should stick creeps.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np
from typing_extensions import override

from proofroll.core.engine import Regularised
from proofroll.core.errors import NotUnique, Refused
from proofroll.core.events import Event
from proofroll.elements.mechanism import WORLD, Mechanism
from proofroll.elements.mechanism.contact.modes import OPEN
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction, rolling_levers
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.run.capabilities import ALL_SHAPES, CURVED_WALLS, MechanismCapability
from proofroll.elements.mechanism.run.contacts.family import Family, of_contact
from proofroll.elements.mechanism.run.contacts.step_events import StepEvents, state_of
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample
from proofroll.elements.mechanism.scene.rotations import Array, Floats3, frame_of_axis, plain_cross
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import CapsuleShape, HalfSpace, SphereShape
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall
from proofroll.elements.mechanism.scene.shapes.walls.curved import PlacedWall
from proofroll.engines.exudyn.contact.hollow_spheres import HollowSphere, MovingPlane, hollow_centre, hollow_radius
from proofroll.engines.exudyn.native import Output, exu, items
from proofroll.engines.exudyn.settings import ExudynSettings
from proofroll.engines.exudyn.smooth import redundant
from proofroll.engines.exudyn.smooth.redundant import Redundant

_CAPABILITY = MechanismCapability
_OF_CONTACT = {_CAPABILITY.CONTACT, _CAPABILITY.CONTACT_FRICTION, _CAPABILITY.UNBOUNDED_FRICTION}
_TOUCH = CURVED_WALLS | {_CAPABILITY.SPHERES, _CAPABILITY.CAPSULES, _CAPABILITY.PLANES}
PROVIDES = redundant.PROVIDES | _OF_CONTACT | _TOUCH | {_CAPABILITY.TURNING_FRICTION, _CAPABILITY.ORIENTATION}
LACKING: Mapping[str, str] = {
    **redundant.LACKING,
    **dict.fromkeys(ALL_SHAPES - _TOUCH, "Exudyn's contacts are of spheres with a radius"),
    _CAPABILITY.STATIC_FRICTION: "this formulation gives a contact one coefficient",
    _CAPABILITY.SLIP_REBOUNDS: "this formulation has no rebounds",
    _CAPABILITY.CONTACT_REBOUNDS: "its restitution is a damping that comes near it with ever shorter steps alone",
}
# Distance from the centre of the triangle that stands for a plane to its sides, in metres, and of one that follows its
# sphere in radii of that: the sphere moves by far less than one between two residuals.
_WIDE, _FOLLOWS = 1e3, 10.0
# Missing friction at the start, in units of the largest contact force: less than the first counts as none; the
# tolerance of accelerations is at most the second, as for soft loops. Where one contact lacks more, first forces prove
# nothing.
_LITTLE, _LARGEST = 1e-6, 0.5
# Relative error of accelerations at the start that Exudyn differentiates numerically.
_DIFFERENCED = 1e-5
# Coefficient that stands for unbounded friction. Its zone is as much wider, so that friction rises with the slip as
# that of a coefficient of 1, and a contact creeps by friction_zone times its friction over its normal force.
_GRIP = 100.0
_CORNERS = ((-1.0, -1.0, 0.0), (2.0, -1.0, 0.0), (-1.0, 2.0, 0.0))


def family(settings: ExudynSettings) -> Mapping[str, str]:
    """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
    if settings.formulation != "spheres":
        return of_contact(Family.HARD)
    return of_contact(Family.SOFTENED, stiffness=settings.stiffness, zone=settings.friction_zone)


class _Made(NamedTuple):
    """One contact in Exudyn.

    Attributes:
        item: its object.
        data: node with its gap [m] and slip speed [m/s].
        sign: of its force on body a.
        sunk: depth at the start [m].
        zone: slip speed from which its friction is at the bound [m/s]; infinite where friction is unbounded.
    """

    item: Any
    data: Any
    sign: float
    sunk: float
    zone: float


class Spheres(Redundant):
    """Run with contacts of spheres; see :class:`proofroll.core.engine.Engine` for the methods."""

    provides: ClassVar[frozenset[str]] = PROVIDES
    lacking: ClassVar[Mapping[str, str]] = LACKING

    def _add_contacts(self, mechanism: Mechanism, settings: ExudynSettings) -> None:
        """Adds contacts at the depth of their load at the start, with spheres enlarged by that depth."""
        self._contacts: list[_Made] = []
        self._events, self._watched = StepEvents(mechanism.contacts, settings.dt), False
        self._following: list[HollowSphere | MovingPlane] = []
        self._resisting: list[TurningFriction] = []
        self._softness, self._larger, self._builds_up = 0.0, 0.0, False
        if not mechanism.contacts:
            return
        for contact in mechanism.contacts:
            _check(contact)
        dynamics = ContactDynamics(mechanism)
        try:
            start = dynamics.solve(*mechanism.start(), dynamics.begin()[0])
        except NotUnique:  # the contact forces are not determined
            start = dynamics.solve(*mechanism.start(), (OPEN,) * len(dynamics.contacts))
        load = float(np.abs(start.force[: len(mechanism.contacts)]).max(initial=0.0))
        missing = [0.0]
        for number, contact in enumerate(mechanism.contacts):
            touch = start.state.touching[number]
            slip = touch.slide - touch.normal * (touch.normal @ touch.slide)
            pressed, speed = max(float(start.force[number] @ touch.normal), 0.0), float(np.linalg.norm(slip))
            self._contacts.append(self._add_contact(contact, touch.gap, pressed, speed, settings))
            if speed < settings.penalty[1]:
                held = float(np.linalg.norm(start.force[number] - pressed * touch.normal))
                if contact.friction > _GRIP and held > max(_GRIP * pressed, _LITTLE * load):
                    needed = f"{contact.name} needs a friction of {held:.3g} N at {pressed:.3g} N of normal force"
                    raise Refused(f"{needed}; here a coefficient of {_GRIP:g} stands for unbounded friction")
                missing.append(held)
        moments = start.force[len(start.force) - len(dynamics.turning) :]
        for friction, moment in zip(dynamics.turning, moments, strict=True):
            missing.append(self._add_turning(friction, moment, start.state.touching[friction.pressed_by], settings))
        if self._following:
            self.system.SetPreNewtonResidualUserFunction(self._follow)
        self._builds_up = sum(missing) > _LITTLE * load
        if self._builds_up:
            most = np.inf if max(missing) > _LARGEST * load else _LARGEST
            self._softness = min(most, 2 * sum(missing) / load)

    def _add_contact(
        self, contact: BodyContact, gap: float, pressed: float, slip: float, settings: ExudynSettings
    ) -> _Made:
        """Adds a contact with the normal force ``pressed`` [N], ``gap`` [m] and ``slip`` [m/s] at the start."""
        stiffness, zone = settings.penalty
        sunk = pressed / stiffness
        sides = [(contact.body_a, contact.shape_a), (contact.body_b, contact.shape_b)]
        sign = 1.0
        if isinstance(contact.shape_a, HalfSpace | CurvedWall):
            sides, sign = sides[::-1], -1.0
        (body, shape), (partner, second) = sides
        assert isinstance(shape, SphereShape)
        self._larger = max(self._larger, sunk / shape.radius)
        data = self.system.AddNode(
            items.NodeGenericData(initialCoordinates=[gap - sunk, slip, 0.0, 0.0], numberOfDataCoordinates=4)
        )
        law: dict[str, Any] = {
            "nodeNumber": data,
            "dynamicFriction": min(contact.friction, _GRIP),
            "frictionProportionalZone": zone * _GRIP if np.isinf(contact.friction) else zone,
            "contactStiffness": stiffness,
            "contactDamping": 2 * math.sqrt(stiffness * self._moved(body, partner)),
        }
        if isinstance(second, HalfSpace):
            ball, plane = self._add_plane(second, partner, shape, body)
            wide = _WIDE if partner == WORLD else _FOLLOWS * shape.radius
            frame = self._turns[partner] @ frame_of_axis(second.normal)
            made = items.ObjectContactSphereTriangle(
                markerNumbers=[ball, plane],
                sphereRadius=shape.radius + sunk,
                trianglePoints=exu.Vector3DList([wide * frame @ np.array(corner) for corner in _CORNERS]),
                includeEdges=0,
                **law,
            )
        elif isinstance(second, CurvedWall):
            hollow = self._add_hollow(second, partner, shape, body)
            self._following.append(hollow)
            if sunk >= 2 * hollow.radius:
                depth = f"{contact.name} starts {sunk:.3g} m deep in a contact of {stiffness:g} N/m"
                raise Refused(f"{depth}, beyond its wall's other side; give a larger stiffness")
            made = items.ObjectContactSphereSphere(
                markerNumbers=[hollow.sphere, hollow.marker],
                spheresRadii=[shape.radius + sunk / 2, hollow.radius - sunk / 2],  # or what rolls would slip
                isHollowSphere1=True,
                **law,
            )
        else:
            assert isinstance(second, SphereShape)
            made = items.ObjectContactSphereSphere(
                markerNumbers=[self.marker(body, shape.centre), self.marker(partner, second.centre)],
                spheresRadii=[shape.radius + sunk, second.radius],
                **law,
            )
        sticks, slips = np.isinf(contact.friction), not contact.friction
        return _Made(
            item=self.system.AddObject(made),
            data=data,
            sign=sign,
            sunk=sunk,
            zone=np.inf if sticks else 0.0 if slips else zone,
        )

    def _add_turning(
        self, friction: TurningFriction, moment: Array, touch: Touching, settings: ExudynSettings
    ) -> float:
        """Adds a friction against turning; returns the force at its sphere [N] that its ``moment`` at rest lacks."""
        contact, made = self._mechanism.contacts[friction.pressed_by], self._contacts[friction.pressed_by]
        radius = max(shape.radius for shape in (contact.shape_a, contact.shape_b) if isinstance(shape, SphereShape))
        zone = settings.penalty[1] / radius

        item, kind, output = (
            self.system.GetObject(made.item),
            exu.ConfigurationType.Current,
            self.system.GetMarkerOutput,
        )
        end_a, end_b = item["markerNumbers"]
        outward = -made.sign if item.get("isHollowSphere1") else 1.0  # sense of the centres' line against the normal

        def between_spheres() -> tuple[float, Floats3]:
            xa, ya, za = output(end_a, Output.Position, kind).tolist()
            xb, yb, zb = output(end_b, Output.Position, kind).tolist()
            x, y, z = xa - xb, ya - yb, za - zb
            distance = outward * math.hypot(x, y, z)
            Fx, Fy, Fz = self.system.GetObjectOutput(made.item, Output.Force).tolist()
            pressed = abs((x * Fx + y * Fy + z * Fz) / distance)
            return pressed, (x / distance, y / distance, z / distance)

        def on_plane() -> tuple[float, Floats3]:
            _, normal, _ = self._lying(made)
            force = self.system.GetObjectOutput(made.item, Output.Force)
            x, y, z = normal.tolist()
            return made.sign * float(normal @ force), (x, y, z)

        pressing = between_spheres if "spheresRadii" in item else on_plane

        bodies = contact.body_a, contact.body_b
        self._resisting.append(friction)
        places = [
            shape.centre if friction.bend and isinstance(shape, SphereShape) else np.zeros(3)
            for shape in (contact.shape_a, contact.shape_b)
        ]
        markers = [None if body == WORLD else self.marker(body, at) for body, at in zip(bodies, places, strict=True)]
        add_turning(self.system, friction, markers, pressing, zone)
        w_a, w_b = (self._at_start.w_WB[self._mechanism.body_index[body]] for body in bodies)
        turns = np.linalg.norm(friction.opposed(touch.normal, w_a - w_b, touch.slide)) >= zone
        return 0.0 if turns else float(np.linalg.norm(moment)) / radius

    def _add_plane(self, plane: HalfSpace, plane_body: str, sphere: SphereShape, body: str) -> tuple[Any, Any]:
        """Adds the markers of a sphere and of the triangle that stands for a plane; that of a moving body follows."""
        turn, com, number = self._turns[plane_body], self._com[plane_body], self.bodies[plane_body]
        point, normal, ball = np.array(plane.point), np.array(plane.normal), self.marker(body, sphere.centre)
        centre = point if plane_body == WORLD else self._seen_from(plane_body, body, sphere)
        place = turn @ (centre - normal * (normal @ (centre - point)) - com)
        marker = self.system.AddMarker(items.MarkerBodyRigid(bodyNumber=number, localPosition=place))
        if plane_body != WORLD:
            place, axis = turn @ (point - com), turn @ normal
            self._following.append(MovingPlane(marker=marker, sphere=ball, body=number, point=place, normal=axis))
        return ball, marker

    def _seen_from(self, wall_body: str, body: str, sphere: SphereShape) -> Array:
        """Centre of a sphere at the start, in the frame of the wall's body [m]."""
        index, motion = self._mechanism.body_index, self._at_start
        wall, ball = index[wall_body], index[body]
        centre = motion.p_WB[ball] + motion.R_WB[ball] @ sphere.centre
        return np.asarray(motion.R_WB[wall].T @ (centre - motion.p_WB[wall]))

    def _add_hollow(self, wall: CurvedWall, wall_body: str, sphere: SphereShape, body: str) -> HollowSphere:
        """Adds the markers of a hollow sphere that stands for a wall, where it is at the start."""
        centre = self._seen_from(wall_body, body, sphere)
        turn, com, radius = self._turns[wall_body], self._com[wall_body], hollow_radius(wall, centre, sphere.radius)
        placed, (x, y, z) = PlacedWall(wall, turn, com), (turn @ (centre - com)).tolist()
        place = hollow_centre(placed, (x, y, z), sphere.radius, radius)
        marker = items.MarkerBodyRigid(bodyNumber=self.bodies[wall_body], localPosition=place)
        return HollowSphere(
            marker=self.system.AddMarker(marker),
            sphere=self.marker(body, sphere.centre),
            body=None if wall_body == WORLD else self.bodies[wall_body],
            wall=placed,
            radius=radius,
            of_sphere=sphere.radius,
        )

    def _follow(self, system: Any, t: float, newton_iteration: int, discontinuous_iteration: int) -> None:  # noqa: ARG002 -- Exudyn's signature
        for wall in self._following:
            wall.follow(system)

    def watch_events(self) -> None:
        """See :class:`proofroll.core.engine_abilities.WatchesEvents`."""
        self._watched = bool(self._events)
        if self._watched:
            self.system.SetPostStepUserFunction(self._observe)

    def _observe(self, system: Any, t: float) -> bool:
        """Takes the contacts' states after a step; Exudyn calls it once at the start, too. True goes on."""
        if t > 0.0:
            states = []
            for made in self._contacts:
                gap, slip, _, _ = system.GetNodeOutput(made.data, Output.Coordinates).tolist()
                states.append(state_of(-gap, slip, made.zone))
            self._events.observe(t, tuple(states))
        return True

    def events(self) -> Sequence[Event] | None:
        """See :class:`proofroll.core.engine_abilities.LocatesEvents`; what slips faster than its zone has left it."""
        return self._events.events() if self._watched else None

    def _moved(self, *bodies: str) -> float:
        """Reduced mass of two bodies [kg]; the world counts as infinite."""
        masses = {body.name: body.mass for body in self._mechanism.bodies}
        return 1 / sum(1 / masses[body] for body in bodies if body in masses)

    @override
    def sample(self) -> MechanismSample:
        force = [made.sign * np.array(self.system.GetObjectOutput(made.item, Output.Force)) for made in self._contacts]
        return replace(super().sample(), contact_force=np.reshape(force, (len(force), 3)))

    @override
    def built(self) -> MechanismBuilt:
        model = super().built()
        if not self._contacts:
            return model
        gaps, normals, places = zip(*(self._lying(made) for made in self._contacts), strict=True)
        model = replace(
            model,
            contact_gap=np.array(gaps),
            contact_normal=np.array(normals),
            contact_place=np.array(places),
            contact_friction=np.array([self.system.GetObject(made.item)["dynamicFriction"] for made in self._contacts]),
            contact_restitution=np.zeros(len(self._contacts)),
            contact_rolling=rolling_levers(self._resisting, len(self._contacts)),
        )
        larger = Regularised(_DIFFERENCED + self._larger, "a sphere is larger by its indentation")
        if self._builds_up:  # then the first accelerations lack friction and prove nothing
            larger = Regularised(self._softness, "friction of a sticking contact builds up with the creep")
            model = replace(model, acceleration=None, angular_acceleration=None)
        return replace(model, regularised=dict.fromkeys(("acceleration", "angular_acceleration"), larger))

    def _lying(self, made: _Made) -> tuple[float, Array, Array]:
        """Gap [m], normal from b to a, and place [m] of a contact, read from Exudyn's object."""
        item = self.system.GetObject(made.item)
        kind = exu.ConfigurationType.Current
        point_a, point_b = (
            np.array(self.system.GetMarkerOutput(k, Output.Position, kind)) for k in item["markerNumbers"]
        )
        if "spheresRadii" in item:
            distance = float(np.linalg.norm(point_a - point_b))
            n, (radius_a, radius_b) = (point_a - point_b) / distance, item["spheresRadii"]
            if item["isHollowSphere1"]:
                radius = radius_a - made.sunk / 2
                return radius_b + made.sunk / 2 - radius - distance, -made.sign * n, point_a + radius * n
            radius = radius_a - made.sunk
            return distance - radius - radius_b, n, point_a - radius * n
        R = np.reshape(self.system.GetMarkerOutput(item["markerNumbers"][1], Output.RotationMatrix, kind), (3, 3))
        corners = np.array([item["trianglePoints"][k] for k in range(3)]) @ R.T  # iterated over, it never ends
        n = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        n /= np.linalg.norm(n)
        radius = item["sphereRadius"] - made.sunk
        return float(n @ (point_a - point_b - corners[0])) - radius, made.sign * n, point_a - radius * n


def _check(contact: BodyContact) -> None:
    """Raises Refused for a capsule that touches with its side."""
    if any(isinstance(shape, CapsuleShape) for shape in (contact.shape_a, contact.shape_b)):
        raise Refused(f"the side of a capsule touches in {contact.name}; Exudyn's contacts are of spheres and walls")


def add_turning(
    system: Any,
    friction: TurningFriction,
    markers: Sequence[Any],
    pressing: Callable[[], tuple[float, Floats3]],
    zone: float,
) -> None:
    """Adds the moment of one friction between the bodies of its contact, as loads beside it.

    A connector of two bodies would do; but Exudyn differentiates it by each of its coordinates in each step, which
    takes five times as many calls.

    Args:
        system: Exudyn's system.
        friction: its law.
        markers: of the contact's bodies a and b; of a ball whose motion is resisted at its centre; None: the world.
        pressing: gives the present normal force [N] and normal of the contact, from b to a.
        zone: angular velocity up to which the moment is proportional to it [rad/s].
    """
    marker_a, marker_b = markers
    bend, coefficient, spins = friction.bend, friction.friction, friction.spins

    def read(marker: Any, output: Any) -> Floats3:
        if marker is None:
            return 0.0, 0.0, 0.0
        x, y, z = system.GetMarkerOutput(marker, output, exu.ConfigurationType.Current).tolist()
        return x, y, z

    def apart(output: Any) -> Floats3:
        (xa, ya, za), (xb, yb, zb) = read(marker_a, output), read(marker_b, output)
        return xa - xb, ya - yb, za - zb

    def opposed(normal: Floats3) -> Floats3:
        """Angular velocity that the moment opposes; of a ball that rolls as its centre moves over the wall [rad/s]."""
        if not bend:
            return apart(Output.AngularVelocity)
        (x, y, z), of_wall = apart(Output.Velocity), read(marker_b if bend > 0 else marker_a, Output.AngularVelocity)
        if any(of_wall):
            u, v, w = plain_cross(of_wall, apart(Output.Position))
            x, y, z = x - u, y - v, z - w
        x, y, z = plain_cross(normal, (x, y, z))
        return bend * x, bend * y, bend * z

    def moment(sign: float, *_state: Any) -> list[float]:
        """Moment on a body in the world [N m]; ``sign``: 1 for body a, -1 for body b."""
        N, normal = pressing()
        if N <= 0.0:
            return [0.0, 0.0, 0.0]
        (nx, ny, nz), (x, y, z) = normal, opposed(normal)
        spin = nx * x + ny * y + nz * z
        u, v, w = spin * nx, spin * ny, spin * nz
        x, y, z = (u, v, w) if spins else (x - u, y - v, z - w)
        scale = -sign * coefficient * N / max(math.hypot(x, y, z), zone)
        return [scale * x, scale * y, scale * z]

    for marker, sign in ((marker_a, 1.0), (marker_b, -1.0)):
        if marker is not None:
            load = partial(moment, sign)
            system.AddLoad(items.LoadTorqueVector(markerNumber=marker, loadVector=[0] * 3, loadVectorUserFunction=load))
