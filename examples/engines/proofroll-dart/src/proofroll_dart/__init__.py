"""DART for proofroll: mechanisms as skeletons, stepped by DART, or integrated by scipy with DART's accelerations."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import dartpy as dart
import numpy as np
from annotated_types import Gt, Le
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from proofroll.adapter import (
    WORLD,
    Diverged,
    InputError,
    Joint,
    Mechanism,
    MechanismBuilt,
    MechanismCapability,
    MechanismSample,
    Scene,
    Scheme,
    mechanism_of,
    value_at,
    whole_steps,
)

_KINDS = {"fixed": "Weld", "revolute": "Revolute", "prismatic": "Prismatic", "universal": "Universal"}
_DRIVES = {MechanismCapability[name] for name in ("JOINT_SPRINGS", "ACTUATORS", "SATURATION", "SIGNALS")}
_PROVIDES = frozenset({MechanismCapability[name.upper()] for name in _KINDS} | _DRIVES)
_SWITCHING = frozenset({MechanismCapability.JOINT_FRICTION, MechanismCapability.STOPS})
_LACKING = {
    MechanismCapability.SPRINGS: "DART has no springs between points",
    MechanismCapability.ARMATURE: "DART's joints have no inertia of their own",
    MechanismCapability.COUPLINGS: "this version of dartpy has no mimic joints",
    MechanismCapability.CONTACT: "DART's friction is a pyramid, and it has no setter for the cone",
    MechanismCapability.FREE: "this adapter integrates coordinates whose rates are the velocities",
    MechanismCapability.SPHERICAL: "this adapter integrates coordinates whose rates are the velocities",
}


@dataclass(frozen=True)
class DartSettings:
    """Settings of DART.

    Attributes:
        formulation: ``world``, DART's own steps; ``forward_dynamics``, DART's accelerations, integrated by scipy.
        preset: ``default`` for ``world``, ``matched`` for ``forward_dynamics``.
        dt: step of a world [s].
        rtol: tolerance of scipy's DOP853.
    """

    formulation: Literal["world", "forward_dynamics"] = "world"
    preset: Literal["default", "matched"] = "default"
    dt: Annotated[float, Gt(0)] | None = None
    rtol: Annotated[float, Gt(0), Le(1)] | None = None

    def __post_init__(self) -> None:
        """Raises InputError unless ``world`` has a step alone, and ``forward_dynamics`` a tolerance alone."""
        wanted, other = ("dt", "rtol") if self.formulation == "world" else ("rtol", "dt")
        if getattr(self, wanted) is None or getattr(self, other) is not None:
            value = getattr(self, wanted)
            raise InputError(f"dart: {wanted}", value, f"{self.formulation} needs it, and has no {other}")

    @property
    def resolution(self) -> str:
        """Name of the setting that trades speed for accuracy."""
        return "dt" if self.formulation == "world" else "rtol"

    @property
    def order(self) -> int | None:
        """Order of a world's semi-implicit Euler; None: scipy's steps are adaptive."""
        return 1 if self.formulation == "world" else None

    @property
    def scheme(self) -> str:
        """Integration scheme of a world; empty for scipy."""
        return Scheme.SEMI_IMPLICIT_EULER if self.formulation == "world" else ""


class Dart:
    """DART through dartpy. See :class:`proofroll.core.engine.Engine`."""

    name: ClassVar[str] = "dart"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"world": _PROVIDES | _SWITCHING, "forward_dynamics": _PROVIDES}
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {"world": _LACKING, "forward_dynamics": _LACKING}
    settings: ClassVar[type[DartSettings]] = DartSettings
    presets: ClassVar[Mapping[str, Mapping[str, DartSettings]]] = {
        "world": {"default": DartSettings("world", "default", 1e-3)},
        "forward_dynamics": {"matched": DartSettings("forward_dynamics", "matched", rtol=1e-10)},
    }

    @staticmethod
    def version() -> str:
        """Version of the package."""
        return importlib.metadata.version("dartpy")

    @staticmethod
    def caveat(settings: DartSettings) -> str:
        """See :class:`proofroll.core.engine_abilities.TellsCaveats`."""
        return "integrated by scipy around DART's accelerations" if settings.formulation == "forward_dynamics" else ""

    @classmethod
    def build(cls, scene: Scene, settings: DartSettings) -> Dart:
        """See :class:`proofroll.core.engine.Engine`; the mechanism is a skeleton in a world of its own."""
        return cls(mechanism_of(scene), settings)

    def __init__(self, mechanism: Mechanism, settings: DartSettings) -> None:
        self._mechanism, self._settings, self._steps, self._t = mechanism, settings, 0, 0.0
        self._skeleton = dart.dynamics.Skeleton()
        self._bodies: dict[str, Any] = {WORLD: None}
        for joint in mechanism.joints:
            self._add(joint)
        self._world = dart.simulation.World()
        self._world.setGravity(list(mechanism.gravity))
        self._world.setTimeStep(settings.dt or 1e-3)
        self._world.addSkeleton(self._skeleton)
        self._put(*mechanism.start())
        self._of = [joint for joint in mechanism.joints for _ in range(joint.nv)]
        laws = [(joint.stiffness, joint.rest, joint.damping) for joint in self._of]
        self._stiffness, self._rest, self._damping = np.array(laws).T
        self._actuators = [(item, mechanism.place_of(item.joint)[1]) for item in mechanism.actuators]

    def _add(self, joint: Joint) -> None:
        create = getattr(self._skeleton, f"create{_KINDS[joint.kind]}JointAndBodyNodePair")
        parent = self._bodies[joint.parent]
        built, body = create(parent) if parent is not None else create()
        given = self._mechanism.bodies[self._mechanism.body_index[joint.child]]
        body.setInertia(dart.dynamics.Inertia(given.mass, given.com, np.array(given.inertia)))
        built.setTransformFromParentBodyNode(_pose(joint.parent_frame, joint.position))
        built.setTransformFromChildBodyNode(_pose(joint.child_frame, joint.child_position))
        if joint.kind == "universal":
            built.setAxis1([0.0, 0.0, 1.0])
            built.setAxis2([1.0, 0.0, 0.0])
        elif joint.nv:
            built.setAxis([0.0, 0.0, 1.0])
        # DART's springs are implicit: even its accelerations at an instant depend on the step
        for index in range(joint.nv if self._settings.dt else 0):
            built.setSpringStiffness(index, joint.stiffness)
            built.setRestPosition(index, joint.rest)
            built.setDampingCoefficient(index, joint.damping)
            built.setCoulombFriction(index, joint.friction)
        if joint.limits:
            built.setPositionLowerLimit(0, joint.limits[0])
            built.setPositionUpperLimit(0, joint.limits[1])
            built.setLimitEnforcement(True)  # without it limits have no effect
        self._bodies[joint.child] = body

    def _put(self, q: Any, v: Any) -> None:
        self._skeleton.setPositions(q)
        self._skeleton.setVelocities(v)

    def _efforts(self, t: float) -> Any:
        """Efforts of the actuators in the present state [N or N m]."""
        q, v = self._skeleton.getPositions(), self._skeleton.getVelocities()
        return np.array([item.effort(t, q[at], v[at]) for item, at in self._actuators])

    def _driven(self, t: float) -> Any:
        """Generalised forces of the joints' drives and of actuators, shape (velocities,)."""
        forces = np.array([float(value_at(joint.torque, t)) for joint in self._of])
        if self._actuators:
            np.add.at(forces, [at for _, at in self._actuators], self._efforts(t))
        return forces

    def _rates(self, t: float, x: Any) -> Any:
        """Rates of the state: velocities, and DART's accelerations."""
        q, v = np.split(x, 2)
        self._put(q, v)
        self._skeleton.setForces(self._driven(t) - self._stiffness * (q - self._rest) - self._damping * v)
        self._skeleton.computeForwardDynamics()
        return np.concatenate([v, self._skeleton.getAccelerations()])

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        dt = self._settings.dt
        if dt is not None:
            for _ in range(whole_steps(self._steps * dt, t, dt)):
                self._skeleton.setForces(self._driven(self._steps * dt))
                self._world.step()
                self._steps += 1
        elif t > self._t:
            x = np.concatenate([self._skeleton.getPositions(), self._skeleton.getVelocities()])
            rtol = self._settings.rtol
            found = solve_ivp(self._rates, (self._t, t), x, method="DOP853", rtol=max(rtol, 3e-14), atol=rtol)
            if not found.success:
                raise Diverged(f"{found.message} (t = {found.t[-1]:g} s)")
            self._put(*np.split(found.y[:, -1], 2))
        self._t = t

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        bodies = [self._bodies[body.name] for body in self._mechanism.bodies]
        poses = [body.getWorldTransform() for body in bodies]
        return MechanismSample(
            np.array([pose.translation() for pose in poses]),
            np.array([body.getLinearVelocity() for body in bodies]),
            np.array([body.getAngularVelocity() for body in bodies]),
            np.array([Rotation.from_matrix(pose.rotation()).as_quat(scalar_first=True) for pose in poses]),
            effort=self._efforts(self._t) if self._actuators else None,
        )

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        inertias = [self._bodies[body.name].getInertia() for body in self._mechanism.bodies]
        return MechanismBuilt(
            mass=np.array([inertia.getMass() for inertia in inertias]),
            com=np.array([inertia.getLocalCOM() for inertia in inertias]),
            inertia=np.array([inertia.getMoment() for inertia in inertias]),
            gravity=np.array(self._world.getGravity()),
            mobility=int(self._skeleton.getNumDofs()),
        )


def _pose(R: Any, p: Any) -> Any:
    pose = dart.math.Isometry3()
    pose.set_rotation(R)
    pose.set_translation(p)
    return pose
