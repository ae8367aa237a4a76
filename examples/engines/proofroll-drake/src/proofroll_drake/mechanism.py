"""A mechanism as a plant of Drake: continuous, with Drake's integrators, or discrete, with its SAP solver and loops."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, DiscreteContactApproximation
from pydrake.multibody.tree import (
    LinearSpringDamper,
    PrismaticSpring,
    RevoluteSpring,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from proofroll.adapter import (
    WITH_AXIS,
    WORLD,
    Diverged,
    Joint,
    Mechanism,
    MechanismBuilt,
    MechanismCapability,
    MechanismSample,
    Refused,
    Regularised,
    Scene,
    held_points,
    mechanism_of,
    value_at,
    whole_steps,
)
from proofroll_drake.contact import DrakeContacts
from proofroll_drake.joints import connect, start
from proofroll_drake.settings import DrakeSettings

_CAPABILITY = MechanismCapability
CONTINUOUS: frozenset[str] = frozenset(
    {
        _CAPABILITY.FIXED, _CAPABILITY.REVOLUTE, _CAPABILITY.PRISMATIC, _CAPABILITY.UNIVERSAL, _CAPABILITY.SPHERICAL,
        _CAPABILITY.PLANAR, _CAPABILITY.FREE, _CAPABILITY.SPRINGS, _CAPABILITY.JOINT_SPRINGS, _CAPABILITY.ARMATURE,
    }
)  # fmt: skip
DISCRETE: frozenset[str] = CONTINUOUS | {
    _CAPABILITY.FIXED_LOOP, _CAPABILITY.REVOLUTE_LOOP, _CAPABILITY.SPHERICAL_LOOP, _CAPABILITY.REDUNDANT,
    _CAPABILITY.COUPLINGS, _CAPABILITY.STOPS, _CAPABILITY.ACTUATORS, _CAPABILITY.SATURATION, _CAPABILITY.SIGNALS,
}  # fmt: skip
_TOUCH = {_CAPABILITY.SPHERES, _CAPABILITY.ELLIPSOIDS, _CAPABILITY.PLANES}
CONTACT: frozenset[str] = CONTINUOUS | _TOUCH | {_CAPABILITY.CONTACT, _CAPABILITY.CONTACT_FRICTION}
_LOOPS = "a continuous plant of Drake has no constraints, and its drives are constant here; take formulation=discrete"
_BESIDE = "Drake has loops and laws of joints beside its SAP solver alone"
_NOWHERE = {
    _CAPABILITY.JOINT_FRICTION: "Drake reads dry friction and does not use it",
    _CAPABILITY.REBOUNDS: "Drake's limits of joints have no restitution",
}
LACKING: Mapping[str, Mapping[str, str]] = {
    "continuous": dict.fromkeys(DISCRETE - CONTINUOUS, _LOOPS) | _NOWHERE,
    "contact": dict.fromkeys(DISCRETE - CONTINUOUS, _BESIDE)
    | {
        _CAPABILITY.CONTACT_REBOUNDS: "Drake's points of contact only dissipate",
        _CAPABILITY.VERTICES: "Drake's spheres have a radius",
    },
    "discrete": _NOWHERE,
}
_SOFT = "Drake's SAP solver makes constraints as stiff as its step can carry, and no stiffer; the first step shows it"
_AT_ITS_END = "a discrete plant takes the forces of springs and dampers as they are at the end of the step"


class DrakeMechanism:
    """Run of a mechanism; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, mechanism: Mechanism, settings: DrakeSettings, time: float) -> None:
        self._turn = (
            2 * np.pi * (settings.dt or 0.0) / time
        )  # of the scene in a step [rad]; its fastest part turns up to three times as fast
        self._mechanism, self._settings, self._steps = mechanism, settings, 0
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, settings.dt or 0.0)
        self._plant = plant
        if settings.dt:
            plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
            plant.SetUseSampledOutputPorts(False)  # reactions of the state as it is, not of the step that led to it
        plant.mutable_gravity_field().set_gravity_vector(mechanism.gravity)
        self._bodies = {WORLD: plant.world_body()} | {body.name: self._body(body) for body in mechanism.bodies}
        self._joints = [connect(plant, self._bodies, joint) for joint in mechanism.joints]
        self._add_forces()
        self._close_loops()
        self._add_laws()
        self._contacts = (
            DrakeContacts(mechanism, plant, scene_graph, self._bodies, settings) if mechanism.pairs else None
        )
        plant.Finalize()
        self._diagram = builder.Build()
        self._simulator = None if settings.dt else Simulator(self._diagram)
        self._root = self._simulator.get_mutable_context() if self._simulator else self._diagram.CreateDefaultContext()
        self._context = plant.GetMyMutableContextFromRoot(self._root)
        for joint, built in zip(mechanism.joints, self._joints, strict=True):
            start(plant, self._context, joint, built)
        moving = any(not isinstance(joint.torque, float) for joint in mechanism.joints)
        self._driven = bool(mechanism.actuators) or moving
        self._drive(0.0)
        if self._simulator:
            integrator = ResetIntegratorFromFlags(self._simulator, settings.integrator or "runge_kutta5", 0.1)
            integrator.set_target_accuracy(settings.rtol)
            self._simulator.Initialize()

    @classmethod
    def build(cls, scene: Scene, settings: DrakeSettings) -> DrakeMechanism:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(mechanism_of(scene), settings, scene.natural_time)

    def _body(self, body: Any) -> Any:
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia
        if not body.mass:
            raise Refused(f"{body.name} has no mass; here each body needs one")
        inertia = SpatialInertia.MakeFromCentralInertia(body.mass, body.com, RotationalInertia(xx, yy, zz, xy, xz, yz))
        return self._plant.AddRigidBody(body.name, inertia)

    def _add_forces(self) -> None:
        """Adds springs of joints and between points, and armature as rotor inertia of actuators."""
        plant = self._plant
        for joint, built in zip(self._mechanism.joints, self._joints, strict=True):
            if joint.stiffness:
                kinds = {"revolute": RevoluteSpring, "prismatic": PrismaticSpring}
                if joint.kind not in kinds:
                    raise Refused(f"{joint.name}: Drake has no spring for a {joint.kind} joint")
                plant.AddForceElement(kinds[joint.kind](built, joint.rest, joint.stiffness))
            if joint.armature:
                actuator = plant.AddJointActuator(joint.name, built)
                actuator.set_default_rotor_inertia(joint.armature)
                actuator.set_default_gear_ratio(1.0)
        for spring in self._mechanism.springs:
            if not spring.length:
                raise Refused(f"{spring.name}: Drake's springs have a free length that is not zero")
            ends = (self._bodies[spring.body_a], spring.position_a, self._bodies[spring.body_b], spring.position_b)
            plant.AddForceElement(LinearSpringDamper(*ends, spring.length, spring.stiffness, spring.damping))

    def _add_laws(self) -> None:
        """Adds couplings and stops, which only discrete plants have."""
        number = self._mechanism.joint_index
        for item in self._mechanism.couplings:
            a, b = (self._joints[number[name]] for name in (item.joint_a, item.joint_b))
            self._plant.AddCouplerConstraint(b, a, item.ratio, item.offset)
        for joint, built in zip(self._mechanism.joints, self._joints, strict=True):
            if joint.limits:
                built.set_position_limits([joint.limits[0]], [joint.limits[1]])

    def _efforts(self, t: float) -> Any:
        """Efforts of the actuators in the present state [N or N m], as from a controller outside of the plant."""
        q, v = self._plant.GetPositions(self._context), self._plant.GetVelocities(self._context)
        found = []
        for item in self._mechanism.actuators:
            built = self._joints[self._mechanism.joint_index[item.joint]]
            found.append(item.effort(t, float(q[built.position_start()]), float(v[built.velocity_start()])))
        return np.array(found)

    def _drive(self, t: float) -> None:
        """Sets drives of joints and efforts of actuators along the velocities."""
        drive = np.zeros(self._plant.num_velocities())
        for joint, built in zip(self._mechanism.joints, self._joints, strict=True):
            if joint.nv == 1:
                drive[built.velocity_start()] = float(value_at(joint.torque, t))
        for item, effort in zip(self._mechanism.actuators, self._efforts(t), strict=True):
            drive[self._joints[self._mechanism.joint_index[item.joint]].velocity_start()] += effort
        self._plant.get_applied_generalized_force_input_port().FixValue(self._context, drive)

    def _close_loops(self) -> None:
        bodies = dict(self._bodies)
        if any(WORLD in (loop.body_a, loop.body_b) for loop in self._mechanism.loops):
            bodies[WORLD] = self._ground()
        for loop in self._mechanism.loops:
            a, b = bodies[loop.body_a], bodies[loop.body_b]
            if loop.kind == "fixed":
                frames = [
                    RigidTransform(RotationMatrix(frame), place)
                    for frame, place in ((loop.frame_a, loop.position_a), (loop.frame_b, loop.position_b))
                ]
                self._plant.AddWeldConstraint(a, frames[0], b, frames[1])
                continue
            for far in held_points(self._mechanism, loop):
                on_a = np.array(loop.position_a) + far * loop.frame_a[:, 2]
                on_b = np.array(loop.position_b) + far * loop.frame_b[:, 2]
                self._plant.AddBallConstraint(a, on_a, b, on_b)

    def _ground(self) -> Any:
        """Adds a body welded to the world: a ball constraint on the world itself crashes Drake 1.51.1."""
        inertia = SpatialInertia.MakeFromCentralInertia(1.0, np.zeros(3), RotationalInertia(1.0, 1.0, 1.0))
        ground = self._plant.AddRigidBody("ground of loops", inertia)
        self._plant.WeldFrames(self._plant.world_frame(), ground.body_frame())
        return ground

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        dt = self._settings.dt
        try:
            if self._simulator:
                self._simulator.AdvanceTo(t)
                return
            for _ in range(whole_steps(self._steps * dt, t, dt)):
                if self._driven:
                    self._drive(self._steps * dt)
                self._context.SetDiscreteState(self._plant.EvalUniquePeriodicDiscreteUpdate(self._context))
                self._steps += 1
                self._root.SetTime(self._steps * dt)
        except RuntimeError as error:
            raise Diverged(f"Drake: {' '.join(str(error).split())} (t = {t:g} s)") from None

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        plant, context = self._plant, self._context
        bodies = [self._bodies[body.name] for body in self._mechanism.bodies]
        poses = [plant.EvalBodyPoseInWorld(context, body) for body in bodies]
        rates = [plant.EvalBodySpatialVelocityInWorld(context, body) for body in bodies]
        force, torque, pressed = None, None, None
        if self._steps or not self._contacts:  # contact forces exist only after a step
            force, torque = self._reactions()
            pressed = self._contacts.forces(context) if self._contacts else None
        return MechanismSample(
            np.array([pose.translation() for pose in poses]),
            np.array([rate.translational() for rate in rates]),
            np.array([rate.rotational() for rate in rates]),
            np.array([pose.rotation().ToQuaternion().wxyz() for pose in poses]),
            joint_force=force,
            joint_torque=torque,
            contact_force=pressed,
            effort=self._efforts(context.get_time()) if self._mechanism.actuators else None,
        )

    def _reactions(self) -> tuple[Any, Any]:
        """Force [N] and moment [N m] on the child of each joint, world axes; NaN for loops.

        Drake gives them in the joint's frame on the child.
        """
        count = len(self._joints) + len(self._mechanism.loops)
        force, torque = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
        told = self._plant.get_reaction_forces_output_port().Eval(self._context)
        for number, built in enumerate(self._joints):
            R = built.frame_on_child().CalcPoseInWorld(self._context).rotation().matrix()
            found = told[int(built.index())]
            force[number] = R @ found.translational()
            torque[number] = R @ found.rotational()
        return force, torque

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        plant, context = self._plant, self._context
        bodies = [self._bodies[body.name] for body in self._mechanism.bodies]
        inertias = [body.default_spatial_inertia() for body in bodies]
        frames = [built.frame_on_child().CalcPoseInWorld(context) for built in self._joints]
        places = np.array([frame.translation() for frame in frames])
        rates: dict[str, Any] = {}
        if self._simulator:
            found = [plant.EvalBodySpatialAccelerationInWorld(context, body) for body in bodies]
            rates["acceleration"] = np.array([rate.translational() for rate in found])
            rates["angular_acceleration"] = np.array([rate.rotational() for rate in found])
        loops = bool(self._mechanism.loops or self._mechanism.couplings)
        soft = {name: Regularised(1.0, _SOFT) for name in ("acceleration", "angular_acceleration") if loops}
        sprung = self._mechanism.springs or any(one.stiffness or one.damping for one in self._mechanism.joints)
        if self._settings.dt and sprung and not loops:
            soft |= {name: Regularised(min(3 * self._turn, 0.5), _AT_ITS_END) for name in ("forces", "torques")}
        found = MechanismBuilt(
            mass=np.array([inertia.get_mass() for inertia in inertias]),
            com=np.array([inertia.get_com() for inertia in inertias]),
            inertia=np.array([_central(inertia) for inertia in inertias]),
            joint_position=places,
            joint_axis=np.array(
                [_axis(context, *pair) for pair in zip(self._mechanism.joints, self._joints, strict=True)]
            ),
            gravity=np.array(plant.gravity_field().gravity_vector()),
            mobility=None if loops else plant.num_velocities(),
            regularised=soft,
            **rates,
        )
        return self._contacts.built(found) if self._contacts else found


def _axis(context: Any, joint: Joint, built: Any) -> Any:
    """World direction of a joint's axis, shape (3,); NaN if the kind has none."""
    if joint.kind not in WITH_AXIS:
        return np.full(3, np.nan)
    column = 0 if joint.kind == "universal" else 2  # see joints.connect
    return built.frame_on_parent().CalcPoseInWorld(context).rotation().matrix()[:, column]


def _central(inertia: Any) -> Any:
    """Inertia about the centre of mass [kg m²], shape (3, 3)."""
    c = np.array(inertia.get_com())
    about_origin = np.array(inertia.CalcRotationalInertia().CopyToFullMatrix3())
    return about_origin - inertia.get_mass() * (c @ c * np.eye(3) - np.outer(c, c))
