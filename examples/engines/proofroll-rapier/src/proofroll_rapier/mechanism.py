"""A mechanism in a world of Rapier: bodies, joints, motors and shapes, stepped in single precision."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import rapier3d

from proofroll.adapter import (
    WORLD,
    Array,
    Body,
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
    drive,
    from_quaternion,
    loads_at,
    mechanism_of,
    targets_at,
    whole_steps,
)
from proofroll_rapier.joints import Motors, joint_data, loop_data, start_reduced
from proofroll_rapier.poses import isometry, quaternion, turn, vector
from proofroll_rapier.settings import RapierSettings
from proofroll_rapier.shapes import add_colliders

_TREES = frozenset(
    {
        MechanismCapability.FIXED,
        MechanismCapability.REVOLUTE,
        MechanismCapability.PRISMATIC,
        MechanismCapability.SPHERICAL,
        MechanismCapability.FREE,
        MechanismCapability.JOINT_SPRINGS,
        MechanismCapability.STOPS,
        MechanismCapability.ACTUATORS,
        MechanismCapability.SATURATION,
        MechanismCapability.HELD,
        MechanismCapability.SIGNALS,
        MechanismCapability.APPLIED_FORCES,
        MechanismCapability.CONTACT,
        MechanismCapability.CONTACT_FRICTION,
        MechanismCapability.CONTACT_REBOUNDS,
        MechanismCapability.VERTICES,
        MechanismCapability.SPHERES,
        MechanismCapability.PLANES,
        MechanismCapability.BOXES,
        MechanismCapability.CAPSULES,
        MechanismCapability.CYLINDERS,
        MechanismCapability.FIXED_LOOP,
        MechanismCapability.REVOLUTE_LOOP,
        MechanismCapability.PRISMATIC_LOOP,
        MechanismCapability.SPHERICAL_LOOP,
        MechanismCapability.REDUNDANT,
    }
)
PROVIDES = {
    "multibody": _TREES | {MechanismCapability.ARMATURE},
    "impulse": _TREES | {MechanismCapability.PLANAR},
}
LACKING = {
    MechanismCapability.JOINT_FRICTION: "Rapier's joints have no dry friction",
    MechanismCapability.STATIC_FRICTION: "Rapier has one coefficient of friction",
    MechanismCapability.REBOUNDS: "Rapier's stops throw nothing back",
    MechanismCapability.SPRINGS: "this adapter builds no springs between points",
    MechanismCapability.COUPLINGS: "Rapier has no gears between joints",
}
_MOVING = "joints and contacts are springs to the solver, which move within the first steps"
_FASTEST = 1e6  # m/s
_SHARP = 1e-5  # m, error of places that the solver leaves


class RapierMechanism:
    """Run of a mechanism; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, mechanism: Mechanism, start: Any, settings: RapierSettings) -> None:
        self._mechanism, self._settings, self._steps = mechanism, settings, 0
        self._world = rapier3d.PhysicsWorld(gravity=tuple(mechanism.gravity))
        self._set_solver()
        handles = {WORLD: self._world.add_body(rapier3d.RigidBody.fixed())}
        for body, *state in zip(
            mechanism.bodies, start.p_WB[0], start.R_WB[0, :-1], start.v_WB[0], start.w_WB[0], strict=True
        ):
            handles[body.name] = self._world.add_body(_body(body, *state))
        add_colliders(mechanism, self._world, handles)
        self._handles = [handles[body.name] for body in mechanism.bodies]
        for rigid in self._rigid():
            rigid.recompute_mass_properties_from_colliders(self._world.colliders)
        joined = self._joined(handles)
        if settings.formulation == "multibody":
            start_reduced(mechanism, self._world, joined, start, settings.preset)
        self._motors = Motors(mechanism, self._world, joined, settings)
        self._motors.set_targets(targets_at(mechanism, 0.0))
        self._is_driven = bool(mechanism.actuators)
        self._is_loaded = bool(mechanism.forces) or any(
            not isinstance(joint.torque, int | float) or joint.torque for joint in mechanism.joints
        )

    @classmethod
    def build(cls, scene: Scene, settings: RapierSettings) -> RapierMechanism:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(mechanism_of(scene), scene.elements[0].start, settings)

    def _set_solver(self) -> None:
        options = self._world.integration_parameters
        options.dt, options.num_solver_iterations = self._settings.dt, self._settings.iterations
        if self._settings.preset == "matched":
            options.friction_model = rapier3d.FrictionModel.COULOMB
            options.normalized_allowed_linear_error = _SHARP
            options.normalized_max_linear_velocity = _FASTEST

    def _joined(self, handles: dict[str, Any]) -> dict[str, Any]:
        """Inserts joints and loops; name of a joint -> its handle."""
        joints: dict[str, Any] = {}
        reduced = self._settings.formulation == "multibody"
        inserted = self._world.multibody_joints if reduced else self._world.impulse_joints
        for joint in self._mechanism.joints:
            if _is_free(joint):
                continue
            ends = handles[joint.parent], handles[joint.child]
            joints[joint.name] = inserted.insert(*ends, joint_data(joint, self._mechanism, self._settings))
        for loop in self._mechanism.loops:
            ends = handles[loop.body_a], handles[loop.body_b]
            self._world.impulse_joints.insert(*ends, loop_data(loop, self._settings))
        return joints

    def _rigid(self) -> Iterable[Any]:
        bodies = self._world.rigid_bodies
        return (bodies[handle] for handle in self._handles)

    def drive(self, values: Iterable[float]) -> None:
        """See :class:`proofroll.core.engine_abilities.TakesTargets`."""
        drive(self._mechanism, values)
        self._motors.set_targets(targets_at(self._mechanism, self._steps * self._settings.dt))

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        for _ in range(whole_steps(self._steps * self._settings.dt, t, self._settings.dt)):
            now = self._steps * self._settings.dt
            if self._is_driven:
                self._motors.set_targets(targets_at(self._mechanism, now))
            if self._is_loaded:
                self._load(now)
            self._world.step()
            self._steps += 1
        if not np.isfinite(self.sample().p_WB).all():
            raise Diverged(f"Rapier's places are not finite at t = {t:g} s")

    def _load(self, t: float) -> None:
        """Sets drives and applied forces of the time [s] at which a step begins, as loads on the centres of mass."""
        sample = self.sample()
        turned = np.array([from_quaternion(one) for one in sample.q_WB])
        forces, moments = loads_at(self._mechanism, t, sample.p_WB, turned)
        for rigid, body, R, force, moment in zip(
            self._rigid(), self._mechanism.bodies, turned, forces, moments, strict=True
        ):
            rigid.reset_forces()
            rigid.reset_torques()
            rigid.add_force(tuple(force))
            rigid.add_torque(tuple(moment - np.cross(R @ body.com, force)))

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`; Rapier's velocities are those of centres of mass."""
        rigid = list(self._rigid())
        places, velocities, spins = (
            np.array([vector(getattr(item, name)) for item in rigid]) for name in ("translation", "linvel", "angvel")
        )
        turned = np.array([quaternion(item.rotation) for item in rigid])
        arms = [from_quaternion(one) @ body.com for one, body in zip(turned, self._mechanism.bodies, strict=True)]
        return MechanismSample(places, velocities - np.cross(spins, arms), spins, turned)

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        held = [rigid.mass_properties for rigid in self._rigid()]
        axes = [from_quaternion(quaternion(item.principal_inertia_local_frame)) for item in held]
        moments = [vector(item.principal_inertia) for item in held]
        return MechanismBuilt(
            mass=np.array([item.mass for item in held], float),
            com=np.array([vector(item.local_com) for item in held]),
            inertia=np.array([R @ np.diag(three) @ R.T for R, three in zip(axes, moments, strict=True)]),
            gravity=vector(self._world.gravity),
            regularised=dict.fromkeys(("acceleration", "angular_acceleration"), Regularised(1.0, _MOVING)),
        )


def _is_free(joint: Joint) -> bool:
    """True for a joint that Rapier needs none for. Raises Refused for a free one that hangs on a body."""
    if joint.kind != JointKind.FREE:
        return False
    if joint.parent != WORLD:
        raise Refused(f"{joint.name}: this adapter frees bodies from the world alone")
    return True


def _body(body: Body, place: Array, R: Array, v: Array, w: Array) -> Any:
    """Body with its mass, in its pose, with the velocity of its origin and its angular velocity."""
    moments, axes = np.linalg.eigh(body.inertia)
    axes[:, 2] *= np.linalg.det(axes)
    made = rapier3d.RigidBodyBuilder(rapier3d.RigidBodyType.DYNAMIC).position(isometry(place, R)).can_sleep(False)
    made = made.linvel(tuple(v + np.cross(w, R @ body.com))).angvel(tuple(w)).gyroscopic_forces(True)
    mass = rapier3d.MassProperties(tuple(body.com), body.mass, tuple(moments), turn(axes))
    return made.additional_mass_properties(mass)
