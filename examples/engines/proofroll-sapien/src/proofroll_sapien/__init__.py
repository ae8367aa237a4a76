"""SAPIEN for proofroll: bodies that touch, by the contact solvers of PhysX on the CPU, in single precision."""

from __future__ import annotations

import importlib.metadata
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from annotated_types import Gt, Le

from proofroll.adapter import (
    WORLD,
    Body,
    Diverged,
    Family,
    HalfSpace,
    Joint,
    Mechanism,
    MechanismBuilt,
    MechanismCapability,
    MechanismSample,
    Refused,
    Regularised,
    Scene,
    Scheme,
    SphereShape,
    frame_of_axis,
    from_quaternion,
    mechanism_of,
    of_contact,
    to_quaternion,
    whole_steps,
)

with warnings.catch_warnings():  # SAPIEN says which library of Vulkan it takes; nothing is drawn here
    warnings.simplefilter("ignore")
    import sapien
from sapien import physx

_CAPABILITY = MechanismCapability
_PROVIDES = frozenset(
    {
        _CAPABILITY.FREE, _CAPABILITY.PLANAR, _CAPABILITY.CONTACT, _CAPABILITY.CONTACT_FRICTION,
        _CAPABILITY.CONTACT_REBOUNDS, _CAPABILITY.VERTICES, _CAPABILITY.SPHERES, _CAPABILITY.CAPSULES,
        _CAPABILITY.BOXES, _CAPABILITY.PLANES,
    }
)  # fmt: skip
_ALONE = "this adapter's bodies are not joined: they are free, or move in a plane"
_LACKING: Mapping[str, str] = {_CAPABILITY[name]: _ALONE for name in ("REVOLUTE", "PRISMATIC", "FIXED")}
_SLOW = 1e-3  # m/s: speed of approach above which bodies rebound, with the preset matched
_LARGE = 1e6  # m/s, rad/s: stands for no bound of velocities
# Relative tolerance of accelerations where feet slide: their friction is some ten degrees off the slip.
_ASIDE = 0.1
_TURNED = {
    "tgs": "each row of friction is found by its own response, so that it is not against the slip",
    "pgs": "friction is a pyramid, so that it is not against the slip",
}
_STRAIGHT = 1e-6  # cosine of a normal, less than 1, up to which it is an axis of the world
_PAIRS = 32  # bits in PhysX's filter of collisions


@dataclass(frozen=True)
class SapienSettings:
    """Settings of SAPIEN.

    Attributes:
        formulation: solver of PhysX: ``tgs``, temporal Gauss-Seidel; ``pgs``, projected Gauss-Seidel.
        preset: ``default``: SAPIEN's own options and step; ``matched``: no damping, no sleep, rebounds at any speed.
        dt: step [s].
        iterations: position iterations of the solver; those of ``tgs`` are substeps.
    """

    formulation: Literal["tgs", "pgs"] = "tgs"
    preset: Literal["default", "matched"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3
    iterations: Annotated[int, Gt(0), Le(255)] = 50

    resolution: ClassVar[str] = "dt"
    order: ClassVar[int | None] = None  # friction that is not Coulomb's has another limit, and single precision a floor
    scheme: ClassVar[str] = Scheme.SEMI_IMPLICIT_EULER
    precision: ClassVar[str] = "single"


class Sapien:
    """PhysX through SAPIEN. See :class:`proofroll.core.engine.Engine`."""

    name: ClassVar[str] = "sapien"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"tgs": _PROVIDES, "pgs": _PROVIDES}
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {"tgs": _LACKING, "pgs": _LACKING}
    made_for: ClassVar[Mapping[str, frozenset[str]]] = dict.fromkeys(provides, frozenset({_CAPABILITY.CONTACT}))
    settings: ClassVar[type[SapienSettings]] = SapienSettings
    presets: ClassVar[Mapping[str, Mapping[str, SapienSettings]]] = {
        name: {"default": SapienSettings(name, "default", 1e-2, 10), "matched": SapienSettings(name)}
        for name in ("tgs", "pgs")
    }

    @staticmethod
    def version() -> str:
        """Version of the package."""
        return importlib.metadata.version("sapien")

    @staticmethod
    def family(settings: SapienSettings) -> Mapping[str, str]:
        """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
        return of_contact(Family.ANISOTROPIC if settings.formulation == "tgs" else Family.PYRAMID)

    @classmethod
    def build(cls, scene: Scene, settings: SapienSettings) -> Sapien:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(mechanism_of(scene), scene.elements[0].start, settings)

    def __init__(self, mechanism: Mechanism, start: Any, settings: SapienSettings) -> None:
        self._mechanism, self._settings, self._steps = mechanism, settings, 0
        joints = _joints(mechanism)
        self._system = _system(mechanism.gravity, settings)
        self._scene = sapien.Scene([self._system])
        self._shapes = self._collision_shapes()
        self._bodies = []
        for body, joint in zip(mechanism.bodies, joints, strict=True):
            k = mechanism.body_index[body.name]
            placed = sapien.Pose(start.p_WB[0, k], to_quaternion(start.R_WB[0, k]))
            self._bodies.append(self._add(body, joint, placed, start.v_WB[0, k], start.w_WB[0, k]))
        for shape, collision in self._shapes.items():
            if isinstance(shape, HalfSpace):
                fixed = physx.PhysxRigidStaticComponent()
                fixed.attach(collision)
                self._place(fixed, sapien.Pose())

    def _collision_shapes(self) -> dict[Any, Any]:
        """PhysX's shape of each shape that may touch; of two shapes only those of a pair collide."""
        contacts = self._mechanism.contacts
        pairs = [(each.shape_a, each.shape_b) for each in contacts]
        shapes = list(dict.fromkeys(shape for pair in pairs for shape in pair))
        laws = _materials([[shapes.index(shape) for shape in pair] for pair in pairs], contacts, len(shapes))
        seconds = list(dict.fromkeys(max(pair, key=lambda shape: isinstance(shape, HalfSpace)) for pair in pairs))
        if len(seconds) > _PAIRS:
            raise Refused(f"PhysX tells {_PAIRS} shapes apart in its filter of collisions, and {len(seconds)} are hit")
        groups = {shape: [0, 0, 0, 0] for shape in shapes}
        for pair in pairs:
            second = max(pair, key=lambda shape: isinstance(shape, HalfSpace))
            (first,) = (shape for shape in pair if shape is not second)
            groups[first][0] |= 1 << seconds.index(second)
            groups[second][1] |= 1 << seconds.index(second)
        found = {}
        for shape, (friction, restitution) in zip(shapes, laws, strict=True):
            material = physx.PhysxMaterial(friction, friction, restitution)
            if isinstance(shape, SphereShape):
                found[shape] = physx.PhysxCollisionShapeSphere(shape.radius, material)
                found[shape].local_pose = sapien.Pose(shape.centre)
            elif isinstance(shape, HalfSpace) and self._world(shape):
                found[shape] = physx.PhysxCollisionShapePlane(material)
                frame = np.roll(frame_of_axis(shape.normal), 1, axis=1)  # PhysX's normal is x
                found[shape].local_pose = sapien.Pose(shape.point, to_quaternion(frame))
            else:
                raise Refused("sides of capsules, and planes that move, are not built")
            found[shape].set_collision_groups(groups[shape])
        return found

    def _world(self, wall: HalfSpace) -> bool:
        return all(
            body == WORLD
            for each in self._mechanism.contacts
            for body, shape in ((each.body_a, each.shape_a), (each.body_b, each.shape_b))
            if shape is wall
        )

    def _add(self, body: Body, joint: Joint, pose: Any, v: Any, w: Any) -> Any:
        """Adds a body with its shapes, in its pose, with the velocity of its origin and its angular velocity."""
        moments, axes = np.linalg.eigh(body.inertia)
        axes[:, 2] *= np.linalg.det(axes)
        made = physx.PhysxRigidDynamicComponent()
        own = {
            shape: None
            for each in self._mechanism.contacts
            for name, shape in ((each.body_a, each.shape_a), (each.body_b, each.shape_b))
            if name == body.name
        }
        for shape in own:
            made.attach(self._shapes[shape])
        made.mass, made.inertia = body.mass, moments
        made.cmass_local_pose = sapien.Pose(body.com, to_quaternion(axes))
        made.solver_position_iterations = self._settings.iterations
        if self._settings.preset == "matched":
            made.linear_damping = made.angular_damping = made.sleep_threshold = 0.0
            made.max_linear_velocity = made.max_angular_velocity = _LARGE
        if joint.kind == "planar":
            made.set_locked_motion_axes(_held(joint))
        self._place(made, pose)
        made.linear_velocity = v + np.cross(w, from_quaternion(pose.q) @ body.com)  # of the centre of mass
        made.angular_velocity = w
        return made

    def _place(self, component: Any, pose: Any) -> None:
        entity = sapien.Entity()
        entity.add_component(component)
        entity.pose = pose
        self._scene.add_entity(entity)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        for _ in range(whole_steps(self._steps * self._settings.dt, t, self._settings.dt)):
            self._system.step()
            self._steps += 1
        if not all(np.isfinite(body.entity.pose.p).all() for body in self._bodies):
            raise Diverged(f"PhysX's places are not finite at t = {t:g} s")

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`; contact forces are those of the last step, none at time 0."""
        p, q, v, w = (
            np.array(each, float)
            for each in zip(
                *(
                    (body.entity.pose.p, body.entity.pose.q, body.linear_velocity, body.angular_velocity)
                    for body in self._bodies
                ),
                strict=True,
            )
        )
        for k, body in enumerate(self._mechanism.bodies):
            v[k] -= np.cross(w[k], from_quaternion(q[k]) @ body.com)
        return MechanismSample(p, v, w, q, contact_force=self._forces() if self._steps else None)

    def _forces(self) -> Any:
        """Forces on the first body of each contact [N], shape (contacts, 3).

        PhysX tells the normal part alone, so that components along which friction may act are NaN.
        """
        contacts = self._mechanism.contacts
        keys = [(self._shapes[each.shape_a], self._shapes[each.shape_b]) for each in contacts]
        numbers = {key: k for k, pair in enumerate(keys) for key in (pair, pair[::-1])}
        found = np.zeros((len(contacts), 3))
        for told in self._system.get_contacts():
            k = numbers[tuple(told.shapes)]
            sign = 1 if told.shapes[0] == keys[k][0] else -1  # normals and impulses are those on the first shape
            for point in told.points:
                found[k] += sign * np.array(point.impulse, float) / self._settings.dt
                if contacts[k].friction:
                    found[k, np.abs(point.normal) < 1 - _STRAIGHT] = np.nan
        return found

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`; PhysX takes the mean of the coefficients of two shapes."""
        inertias = [from_quaternion(body.cmass_local_pose.q) for body in self._bodies]
        materials = [
            [self._shapes[shape].physical_material for shape in (each.shape_a, each.shape_b)]
            for each in self._mechanism.contacts
        ]
        return MechanismBuilt(
            mass=np.array([body.mass for body in self._bodies]),
            com=np.array([body.cmass_local_pose.p for body in self._bodies], float),
            inertia=np.array([R @ np.diag(body.inertia) @ R.T for R, body in zip(inertias, self._bodies, strict=True)]),
            gravity=np.array(self._system.config.gravity, float),
            contact_friction=np.array([(a.dynamic_friction + b.dynamic_friction) / 2 for a, b in materials]),
            contact_restitution=np.array([(a.restitution + b.restitution) / 2 for a, b in materials]),
            regularised=dict.fromkeys(
                ("acceleration", "angular_acceleration"), Regularised(_ASIDE, _TURNED[self._settings.formulation])
            ),
        )


def _system(gravity: Any, settings: SapienSettings) -> Any:
    """A system of its own. Options of a system are global in SAPIEN when it is made; they are put back here."""
    before = physx.get_scene_config()
    kept = before.__getstate__()
    chosen = {"bounce_threshold": _SLOW} if settings.preset == "matched" else {}
    physx.set_scene_config(gravity=gravity, enable_tgs=settings.formulation == "tgs", **chosen)
    system = physx.PhysxCpuSystem()
    system.timestep = settings.dt
    restored = physx.PhysxSceneConfig()
    restored.__setstate__(kept)
    physx.set_scene_config(restored)
    return system


def _joints(mechanism: Mechanism) -> list[Joint]:
    """Joint of each body. Raises Refused unless bodies touch, and each is joined to the world."""
    if not mechanism.contacts:
        raise Refused("only bodies that touch are built")
    of = {joint.child: joint for joint in mechanism.joints}
    if any(joint.parent != WORLD for joint in of.values()):
        raise Refused(_ALONE)
    return [of[body.name] for body in mechanism.bodies]


def _held(joint: Joint) -> list[bool]:
    """Directions and axes of the world in which a body of a planar joint does not move."""
    (normal,) = (np.abs(joint.parent_frame[:, 2]) > 1 - 1e-9).nonzero()
    if len(normal) != 1:
        raise Refused(f"{joint.name}: PhysX holds bodies in planes of x, y and z of the world alone")
    return [axis == normal[0] for axis in range(3)] + [axis != normal[0] for axis in range(3)]


def _materials(pairs: Any, contacts: Any, count: int) -> Any:
    """Friction and restitution of each shape, (shapes, 2), whose means over two are those of the pairs."""
    means = np.zeros((len(pairs), count))
    for row, pair in zip(means, pairs, strict=True):
        row[pair] = 0.5
    wanted = np.array([(each.friction, each.restitution) for each in contacts])
    found = np.linalg.lstsq(means, wanted)[0]
    if np.max(np.abs(means @ found - wanted)) > 1e-9 or np.min(found) < -1e-9 or np.max(found[:, 1]) > 1 + 1e-9:
        raise Refused("PhysX takes means of two shapes' coefficients, which cannot be those of all pairs here")
    return np.clip(found, 0, None)
