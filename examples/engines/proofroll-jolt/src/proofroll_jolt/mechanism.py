"""A mechanism in a world of Jolt: boxes of the bodies' inertia, held by constraints, stepped in single precision."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import culverin
import numpy as np

from proofroll.adapter import (
    WORLD,
    Array,
    Diverged,
    Joint,
    JointKind,
    Mechanism,
    MechanismBuilt,
    MechanismCapability,
    MechanismSample,
    Refused,
    Regularised,
    Scene,
    from_quaternion,
    loads_at,
    mechanism_of,
    to_quaternion,
    whole_steps,
)
from proofroll_jolt.bodies import add_body, add_ground, box, measured, world_of
from proofroll_jolt.settings import JoltSettings

PROVIDES = frozenset(
    {
        MechanismCapability.FIXED,
        MechanismCapability.REVOLUTE,
        MechanismCapability.PRISMATIC,
        MechanismCapability.FREE,
        MechanismCapability.STOPS,
        MechanismCapability.SIGNALS,
        MechanismCapability.APPLIED_FORCES,
        MechanismCapability.FIXED_LOOP,
        MechanismCapability.REVOLUTE_LOOP,
        MechanismCapability.PRISMATIC_LOOP,
        MechanismCapability.SPHERICAL_LOOP,
        MechanismCapability.REDUNDANT,
    }
)
LACKING = {
    MechanismCapability.SPHERICAL: "culverin leaves Jolt's gyroscopic moment off, and a body on a ball joint needs it",
    MechanismCapability.JOINT_FRICTION: "culverin has no dry friction of joints",
    MechanismCapability.JOINT_SPRINGS: "this adapter builds no springs, dampers or drives of joints",
    MechanismCapability.ACTUATORS: "this adapter builds no motors",
    MechanismCapability.ARMATURE: "Jolt's bodies have no inertia of drives",
    MechanismCapability.REBOUNDS: "Jolt's limits of joints have no restitution",
    MechanismCapability.SPRINGS: "this adapter builds no springs between points",
    MechanismCapability.COUPLINGS: "culverin has no gears between joints",
    MechanismCapability.CONTACT: "this adapter builds no contacts",
}
_CONSTRAINTS = {
    JointKind.FIXED: culverin.CONSTRAINT_FIXED,
    JointKind.REVOLUTE: culverin.CONSTRAINT_HINGE,
    JointKind.PRISMATIC: culverin.CONSTRAINT_SLIDER,
    JointKind.SPHERICAL: culverin.CONSTRAINT_POINT,
}
# Jolt's largest spin of a body [rad/s], which culverin leaves as it is.
_FASTEST = 0.25 * math.pi * 60
# Part of an acceleration that the iterations may leave, 0.012 in a four-bar.
_LEFT = 0.05
_ITERATED = "a fixed number of iterations finds the impulses of joints"


class JoltMechanism:
    """Run of a mechanism; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, mechanism: Mechanism, start: Any, settings: JoltSettings) -> None:
        self._mechanism, self._settings, self._steps = mechanism, settings, 0
        if np.linalg.norm(start.w_WB[0], axis=1).max() > _FASTEST:
            raise Refused(f"a body spins faster than {_FASTEST:.4g} rad/s, Jolt's limit, and culverin sets no other")
        self._world = world_of(np.array(mechanism.gravity, float), len(mechanism.bodies))
        handles = {WORLD: add_ground(self._world)}
        poses = {WORLD: (np.zeros(3), np.eye(3))}
        for body, place, R, v, w in zip(
            mechanism.bodies, start.p_WB[0], start.R_WB[0, :-1], start.v_WB[0], start.w_WB[0], strict=True
        ):
            arm = R @ body.com
            handle = add_body(self._world, body, place + arm, R)
            self._world.set_linear_velocity(handle, *(v + np.cross(w, arm)).tolist())
            self._world.set_angular_velocity(handle, *w.tolist())
            handles[body.name], poses[body.name] = handle, (place, R)
        self._world.step(0.0)  # bodies exist from here on
        self._add_constraints(handles, poses)
        self._handles = [handles[body.name] for body in mechanism.bodies]
        self._axes = [box(body)[1] for body in mechanism.bodies]
        self._is_loaded = bool(mechanism.forces)

    @classmethod
    def build(cls, scene: Scene, settings: JoltSettings) -> JoltMechanism:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(mechanism_of(scene), scene.elements[0].start, settings)

    def _add_constraints(self, handles: Mapping[str, int], poses: Mapping[str, tuple[Array, Array]]) -> None:
        """Joints and loops, given by their pivots and axes in the world at the start."""
        held = [
            (joint.kind, joint.parent, joint.child, joint.position, joint.parent_frame, _limits(joint))
            for joint in self._mechanism.joints
            if not _is_free(joint)
        ]
        held += [
            (loop.kind, loop.body_a, loop.body_b, loop.position_a, loop.frame_a, ()) for loop in self._mechanism.loops
        ]
        for name, first, second, position, frame, limits in held:
            place, R = poses[first]
            kind = JointKind(name)
            pivot, axis = tuple((place + R @ position).tolist()), tuple((R @ frame[:, 2]).tolist())
            given: Any = {JointKind.FIXED: None, JointKind.SPHERICAL: (pivot,)}.get(kind, (pivot, axis, *limits))
            self._world.create_constraint(_CONSTRAINTS[kind], handles[first], handles[second], given)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        dt = self._settings.dt
        for _ in range(whole_steps(self._steps * dt, t, dt)):
            if self._settings.preset == "matched":
                for handle in self._handles:
                    self._world.activate(handle)  # else what moves slowly falls asleep
            if self._is_loaded:
                self._load(self._steps * dt)
            self._world.step(dt)
            self._steps += 1
        if not np.isfinite(self._rows("positions", np.float64)).all():
            raise Diverged(f"Jolt's places are not finite at t = {t:g} s")

    def _load(self, t: float) -> None:
        """Sets applied forces of the time [s] at which a step begins, as loads on the centres of mass."""
        sample = self.sample()
        turned = np.array([from_quaternion(one) for one in sample.q_WB])
        forces, moments = loads_at(self._mechanism, t, sample.p_WB, turned)
        for handle, body, R, force, moment in zip(
            self._handles, self._mechanism.bodies, turned, forces, moments, strict=True
        ):
            self._world.apply_force(handle, *force.tolist())
            self._world.apply_torque(handle, *(moment - np.cross(R @ body.com, force)).tolist())

    def _rows(self, name: str, number: Any) -> Array:
        """Rows of the scene's bodies in one of culverin's buffers of four columns."""
        rows = [self._world.get_index(handle) for handle in self._handles]
        return np.frombuffer(getattr(self._world, name), number).reshape(-1, 4)[rows].astype(float)

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`; Jolt's places and velocities are those of centres of mass."""
        centres = self._rows("positions", np.float64)[:, :3]
        velocities, spins = (self._rows(name, np.float32)[:, :3] for name in ("velocities", "angular_velocities"))
        turned = np.roll(self._rows("rotations", np.float32), 1, axis=1)
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        R_WB = [from_quaternion(one) @ axes.T for one, axes in zip(turned, self._axes, strict=True)]
        arms = np.array([R @ body.com for R, body in zip(R_WB, self._mechanism.bodies, strict=True)])
        q_WB = np.array([to_quaternion(R) for R in R_WB])
        return MechanismSample(centres - arms, velocities - np.cross(spins, arms), spins, q_WB)

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`; culverin tells no centres of mass, which are its origins."""
        masses, inertias = zip(*(measured(body) for body in self._mechanism.bodies), strict=True)
        held = not all(_is_free(joint) for joint in self._mechanism.joints)
        softened = dict.fromkeys(("acceleration", "angular_acceleration"), Regularised(_LEFT, _ITERATED))
        return MechanismBuilt(
            mass=np.array(masses),
            inertia=np.array(inertias),
            gravity=np.array(self._world.get_gravity()),
            regularised=softened if held else {},
        )


def _is_free(joint: Joint) -> bool:
    """True for a joint that Jolt needs none for. Raises Refused for a free one that hangs on a body."""
    if joint.kind != JointKind.FREE:
        return False
    if joint.parent != WORLD:
        raise Refused(f"{joint.name}: this adapter frees bodies from the world alone")
    return True


def _limits(joint: Joint) -> tuple[float, ...]:
    """Stops, from the coordinate at the start, which is Jolt's zero. Raises Refused unless Jolt takes them."""
    if not joint.limits:
        return ()
    low, high = (limit - float(joint.q0[0]) for limit in joint.limits)
    widest = math.pi if joint.kind == JointKind.REVOLUTE else math.inf
    if not -widest <= low <= 0 <= high <= widest:
        raise Refused(f"{joint.name}: Jolt's stops lie on both sides of the start, those of a hinge within half a turn")
    return low, high
