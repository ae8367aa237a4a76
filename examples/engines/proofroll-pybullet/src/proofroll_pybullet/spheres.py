"""Free bodies with spheres that touch a plane or each other, by PyBullet's own contacts with a cone of friction."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from proofroll.adapter import (
    WORLD,
    Diverged,
    Mechanism,
    MechanismBuilt,
    MechanismCapability,
    MechanismSample,
    Refused,
    Regularised,
    Scene,
    from_quaternion,
    mechanism_of,
    to_quaternion,
    whole_steps,
)
from proofroll_pybullet.settings import PybulletSettings
from proofroll_pybullet.world import World

_CAPABILITY = MechanismCapability
PROVIDES: frozenset[str] = frozenset(
    {
        _CAPABILITY.FREE,
        _CAPABILITY.CONTACT,
        _CAPABILITY.CONTACT_FRICTION,
        _CAPABILITY.CONTACT_REBOUNDS,
        _CAPABILITY.SPHERES,
        _CAPABILITY.PLANES,
    }
)
_ALONE = "its bodies are free ones, each with its spheres"
LACKING: Mapping[str, str] = {
    str(name): _ALONE for name in (_CAPABILITY.REVOLUTE, _CAPABILITY.PRISMATIC, _CAPABILITY.PLANAR)
}
# Relative tolerance of accelerations where three feet slide: their friction is some ten degrees off the slip.
_ASIDE, _TURNED = 0.1, "each row of friction is found by its own response, so that it is not against the slip"
_LARGE = 1e6  # rad/s: stands for no bound of the angular velocity
_NEAR = 1e-6  # m: largest gap at which bodies count as touching
_SLOW = 1e-6  # m/s: speed of approach above which bodies rebound


class PybulletSpheres:
    """Run of free bodies with spheres; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, mechanism: Mechanism, settings: PybulletSettings) -> None:
        self._mechanism, self._settings, self._steps = mechanism, settings, 0
        self._geometries = {each.name: each for each in mechanism.geometries}
        pairs = [[self._geometries[name] for name in pair.geometries] for pair in mechanism.pairs]
        kinds = {each.kind for pair in pairs for each in pair}
        if kinds - {"sphere", "plane"} or any(each.kind == "plane" and each.body != WORLD for p in pairs for each in p):
            raise Refused("only spheres of bodies, and planes of the world, are built")
        laws = {(pair.friction, pair.restitution) for pair in mechanism.pairs}
        if not laws:
            raise Refused("only bodies that touch are built")
        if len(laws) > 1:
            raise Refused("PyBullet multiplies coefficients of two bodies; pairs with laws of their own are not built")
        self._law = [math.sqrt(value) for value in laws.pop()]  # PyBullet multiplies the coefficients of two bodies
        self._world = World(mechanism.gravity, settings)
        if settings.preset == "matched":
            self._world.setPhysicsEngineParameter(restitutionVelocityThreshold=_SLOW, enableConeFriction=1)
            if self._law[1]:  # corrections of gap and depth would change the speed of a rebound
                self._world.setPhysicsEngineParameter(contactERP=0, contactBreakingThreshold=_NEAR)
        self._item = {WORLD: self._floor([each for pair in pairs for each in pair if each.kind == "plane"])}
        for body, joint in zip(mechanism.bodies, mechanism.joints, strict=True):
            self._item[body.name] = self._body(body, joint)

    @classmethod
    def build(cls, scene: Scene, settings: PybulletSettings) -> PybulletSpheres:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(mechanism_of(scene), settings)

    def _floor(self, planes: list[Any]) -> int | None:
        if len({each.name for each in planes}) > 1:
            raise Refused("one plane is built, not several")
        if not planes:
            return None
        normal, place = np.array(planes[0].normal), np.array(planes[0].position)
        shape = self._world.createCollisionShape(self._world.GEOM_PLANE, planeNormal=normal.tolist())
        item = self._world.createMultiBody(0, shape, basePosition=(normal * (normal @ place)).tolist())
        self._world.changeDynamics(item, -1, lateralFriction=self._law[0], restitution=self._law[1])
        return int(item)

    def _body(self, body: Any, joint: Any) -> int:
        """Adds a body with its spheres; in PyBullet its frame is at the centre of mass along the principal axes."""
        moments, axes = np.linalg.eigh(body.inertia)
        axes[:, 2] *= np.linalg.det(axes)
        self._axes = {**getattr(self, "_axes", {}), body.name: axes}
        own = [each for each in self._geometries.values() if each.body == body.name]
        shape = self._world.createCollisionShapeArray(
            shapeTypes=[self._world.GEOM_SPHERE] * len(own),
            radii=[each.radius for each in own],
            collisionFramePositions=[(axes.T @ (np.array(each.position) - body.com)).tolist() for each in own],
        )
        R = from_quaternion(joint.q0[3:])
        w, x, y, z = to_quaternion(R @ axes)
        place = np.array(joint.q0[:3]) + R @ body.com
        item = self._world.createMultiBody(body.mass, shape, -1, place.tolist(), [x, y, z, w])
        friction, restitution = self._law
        self._world.changeDynamics(
            item, -1, localInertiaDiagonal=moments.tolist(), lateralFriction=friction, restitution=restitution
        )
        if self._settings.preset == "matched":
            self._world.changeDynamics(item, -1, linearDamping=0, angularDamping=0, maxJointVelocity=_LARGE)
        v, w_B = R @ joint.v0[:3], R @ joint.v0[3:]
        self._world.resetBaseVelocity(item, (v + np.cross(w_B, R @ body.com)).tolist(), w_B.tolist())
        return int(item)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        for _ in range(whole_steps(self._steps * self._settings.dt, t, self._settings.dt)):
            self._world.stepSimulation()
            self._steps += 1
        if not np.isfinite(self._poses()[0]).all():
            raise Diverged(f"PyBullet's places are not finite at t = {t:g} s")

    def _poses(self) -> tuple[Any, Any, Any, Any]:
        found = []
        for body in self._mechanism.bodies:
            place, (x, y, z, w) = self._world.getBasePositionAndOrientation(self._item[body.name])
            v, spin = (np.array(each) for each in self._world.getBaseVelocity(self._item[body.name]))
            R = from_quaternion((w, x, y, z)) @ self._axes[body.name].T
            arm = R @ body.com
            found.append((np.array(place) - arm, v - np.cross(spin, arm), spin, to_quaternion(R)))
        p, v, w, q = (np.array(each) for each in zip(*found, strict=True))
        return p, v, w, q

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`; contact forces are those of the last step, none at time 0."""
        p, v, w, q = self._poses()
        return MechanismSample(p, v, w, q, contact_force=self._forces(p, q) if self._steps else None)

    def _forces(self, p: Any, q: Any) -> Any:
        """Forces on the first body of each pair [N], shape (pairs, 3); a contact point is of the nearest sphere."""
        index = {body.name: k for k, body in enumerate(self._mechanism.bodies)}
        force = np.zeros((len(self._mechanism.pairs), 3))
        pairs = [[self._geometries[name] for name in pair.geometries] for pair in self._mechanism.pairs]
        for told in self._world.getContactPoints():
            on_b = np.array(told[7]) * told[9] + np.array(told[11]) * told[10] + np.array(told[13]) * told[12]
            bodies = {told[1]: on_b, told[2]: -on_b}  # the normal points from B to A, and forces are those on A
            best, least = None, math.inf
            for k, (a, b) in enumerate(pairs):
                if {self._item[a.body], self._item[b.body]} != set(bodies):
                    continue
                sphere = a if a.kind == "sphere" else b
                at = p[index[sphere.body]] + from_quaternion(q[index[sphere.body]]) @ np.array(sphere.position)
                apart = abs(float(np.linalg.norm(np.array(told[5]) - at)) - sphere.radius)
                if apart < least:
                    best, least = k, apart
            if best is not None:
                force[best] += bodies[self._item[pairs[best][0].body]]
        return force

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        mass, com, inertia = [], [], []
        for body in self._mechanism.bodies:
            told = self._world.getDynamicsInfo(self._item[body.name], -1)
            axes = self._axes[body.name]
            mass.append(told[0])
            com.append(body.com)
            inertia.append(axes @ np.diag(told[2]) @ axes.T)
        count = len(self._mechanism.pairs)
        told = self._world.getDynamicsInfo(self._item[self._mechanism.bodies[0].name], -1)
        return MechanismBuilt(
            np.array(mass), np.array(com), np.array(inertia), gravity=self._world.gravity(),
            contact_friction=np.full(count, told[1] ** 2), contact_restitution=np.full(count, told[5] ** 2),
            regularised={name: Regularised(_ASIDE, _TURNED) for name in ("acceleration", "angular_acceleration")},
        )  # fmt: skip
