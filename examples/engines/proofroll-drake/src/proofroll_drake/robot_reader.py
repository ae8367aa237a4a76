"""Drake's own importers of URDF and MJCF, with the plant read back."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from proofroll.robots.model import Array
from proofroll.robots.protocol import AtState, Reading, Request, evaluate

# A joint can follow another only in a plant with discrete time.
_STEP = 1e-3


class DrakeRobots:
    """Robot files as ``Parser`` reads them, in a ``MultibodyPlant`` without geometry."""

    kinds: ClassVar[tuple[str, ...]] = ("urdf", "mjcf")
    options: ClassVar[Mapping[str, str]] = {}
    tolerances: ClassVar[Mapping[str, float]] = {}
    says: ClassVar[str] = ""

    def version(self) -> str:
        """Version of the package."""
        return importlib.metadata.version("drake")

    def read(self, request: Request) -> Reading:
        """See :class:`proofroll.robots.protocol.RobotReader`."""
        plant = _plant(request, _STEP if request.robot.mimics else 0.0)
        context = plant.CreateDefaultContext()
        carriers = {body: joint for joint, body in request.children.items()}
        joints = sorted(
            (joint for joint in map(plant.get_joint, plant.GetJointIndices()) if joint.num_velocities()),
            key=lambda joint: joint.velocity_start(),
        )
        named = {_name(joint, carriers): joint for joint in joints}
        dofs = tuple(joint.num_velocities() for joint in joints)
        bodies = {
            name: plant.GetBodyByName(request.children[name])
            for name in named
            if name in request.children and plant.HasBodyNamed(request.children[name])
        }
        frames: dict[str, list[Any]] = {name: [] for name in bodies}

        def at(k: int) -> AtState:
            T = _put(request, plant, context, named, k)
            for name, body in bodies.items():
                frames[name].append(plant.EvalBodyPoseInWorld(context, body))
            gravity = plant.CalcGravityGeneralizedForces(context)

            def inverse(acceleration: Array) -> Array:
                from pydrake.multibody.tree import MultibodyForces

                return np.array(plant.CalcInverseDynamics(context, acceleration, MultibodyForces(plant))) - gravity

            def forward(torque: Array) -> Array:
                plant.get_applied_generalized_force_input_port().FixValue(context, torque)
                return np.array(plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector())

            M = np.array(plant.CalcMassMatrix(context))
            h = np.array(plant.CalcBiasTerm(context)) - gravity
            continuous = None if plant.time_step() > 0 else forward
            return AtState(T, np.zeros(len(T)), M, -np.array(gravity), h, inverse, continuous)

        arrays = evaluate(request, tuple(named), dofs, at)
        inertias = {
            name: plant.CalcSpatialInertia(
                context, body.body_frame(), [other.index() for other in plant.GetBodiesWeldedTo(body)]
            )
            for name, body in bodies.items()
        }
        return Reading(
            tuple(named), dofs,
            {name: float(inertia.get_mass()) for name, inertia in inertias.items()},
            {name: np.array(inertia.get_com()) for name, inertia in inertias.items()},
            {name: _central(inertia) for name, inertia in inertias.items()},
            {name: np.array([X.translation() for X in found]) for name, found in frames.items()},
            {name: np.array([X.rotation().matrix() for X in found]) for name, found in frames.items()},
            coupled=_coupled(request, plant),
            remarks=("in discrete time, as its couplings need: no forward dynamics",) if plant.time_step() > 0 else (),
            **arrays,
        )  # fmt: skip


def _plant(request: Request, step: float) -> Any:
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(step)
    Parser(plant).AddModels(str(request.path))
    if request.kind == "urdf":
        plant.mutable_gravity_field().set_gravity_vector(request.gravity)
        root = plant.GetBodyByName(request.robot.joints[0].child)
        if request.base == "fixed" and root.index() != plant.world_body().index():
            plant.WeldFrames(plant.world_frame(), root.body_frame())
    plant.Finalize()
    return plant


def _name(joint: Any, carriers: Mapping[str, str]) -> str:
    """Name of a joint in the file; Drake makes the joint of a free body itself and names it after the body."""
    if joint.num_velocities() == 6:
        return carriers.get(joint.child_body().name(), joint.name())
    return str(joint.name())


def _put(request: Request, plant: Any, context: Any, joints: Mapping[str, Any], k: int) -> Array:
    """Puts the plant into state ``k``; returns T of ``AtState``.

    In Drake a free joint has the angular velocity first, and a ball joint has it in the parent's axes.
    """
    from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

    states = request.states
    v, T = np.zeros(plant.num_velocities()), np.eye(plant.num_velocities())
    q = np.array(plant.GetDefaultPositions()) if request.kind == "mjcf" else np.zeros(plant.num_positions())
    for name, joint in joints.items():
        start, count = joint.velocity_start(), joint.num_velocities()
        v[start : start + count] = states.velocity[name][k] if name in states.velocity else 0.0
        if name in states.angle:
            q[joint.position_start()] += states.angle[name][k]  # an MJCF describes the default pose
        elif name in states.rotation and count == 3:
            R = states.rotation[name][k]
            q[joint.position_start() : joint.position_start() + 3] = RollPitchYaw(RotationMatrix(R)).vector()
            T[start : start + 3, start : start + 3] = R
    plant.SetPositions(context, q)
    for name, joint in joints.items():
        if joint.num_velocities() == 6:
            start = joint.velocity_start()
            X = RigidTransform(RotationMatrix(states.rotation[name][k]), states.position[name][k])
            plant.SetFreeBodyPose(context, joint.child_body(), X)
            T[start : start + 6, start : start + 6] = np.roll(np.eye(6), 3, axis=0)
    plant.SetVelocities(context, T @ v)
    return T


def _central(inertia: Any) -> Array:
    """Inertia about the centre of mass [kg m²], shape (3, 3)."""
    c = np.array(inertia.get_com())
    about_origin = np.array(inertia.CalcRotationalInertia().CopyToFullMatrix3())
    return np.asarray(about_origin - inertia.get_mass() * (c @ c * np.eye(3) - np.outer(c, c)))


def _coupled(request: Request, plant: Any) -> tuple[str, ...]:
    """Joints that the plant couples to others: all followers of the file, if it has a constraint for each."""
    mimics = request.robot.mimics
    return tuple(mimic.joint for mimic in mimics) if plant.num_constraints() >= len(mimics) > 0 else ()
