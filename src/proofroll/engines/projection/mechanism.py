"""Formulation ``dependent``: a mechanism by the projection method, and what is read back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from proofroll.core.arrays import cross
from proofroll.core.errors import Diverged, Refused
from proofroll.core.integrators import INTEGRATORS
from proofroll.core.stalling import Stalled
from proofroll.elements.mechanism.capabilities import ALL_JOINTS, ALL_LOOPS, FORCES, MechanismCapability, require
from proofroll.elements.mechanism.pose_words import pose
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.sampling import WITH_AXIS, MechanismBuilt, MechanismSample, independent, mechanism_of
from proofroll.engines.projection.dependent import DependentCoordinates, SolvedState
from proofroll.engines.projection.settings import ProjectionSettings

PROVIDES = frozenset(ALL_JOINTS | ALL_LOOPS | FORCES | {MechanismCapability.REDUNDANT})
LACKING: Mapping[str, str] = {
    MechanismCapability.JOINT_FRICTION: "these equations have no law that switches",
    MechanismCapability.ARMATURE: "the mass matrix of dependent coordinates is that of the bodies alone",
}


class ProjectionMechanism:
    """See :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, scene: Any, settings: ProjectionSettings) -> None:
        mechanism = mechanism_of(scene)
        require(mechanism, PROVIDES, LACKING)
        for body in mechanism.bodies:
            if not body.mass or np.linalg.eigvalsh(body.inertia)[0] <= 0:
                raise Refused(
                    f"{body.name} has no mass or no moment of inertia about an axis; here each body needs both"
                )
        self._mechanism, self._equations = mechanism, DependentCoordinates(mechanism)
        self._eliminates = settings.eliminates
        start = self._equations.start
        resolution = float(getattr(settings, settings.resolution))
        integrator = INTEGRATORS[settings.integrator]
        self._motion = integrator(self._equations.rates, self._accepted, start, np.ones(len(start)), resolution)

    def _accepted(self, t: float, x: Array) -> Array:
        if not np.isfinite(x.sum()):
            raise Diverged(f"the state is not finite at t = {t:.6g} s")
        if self._eliminates:
            x = self._equations.eliminated(x)
        self._equations.accept(x)
        return x

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        start = self._motion.t
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # found after the step
                self._motion.advance(t)
        except np.linalg.LinAlgError as error:
            raise Diverged(f"{error}, between t = {start:.6g} s and {t:.6g} s") from None
        except Stalled as error:
            raise Diverged(f"{error}; {pose(self._mechanism, self.sample())}") from None

    def _solved(self) -> tuple[SolvedState, Array, Array, Array]:
        """The equations now; of the bodies rotation, angular velocity, and centre of mass from their origins."""
        answer = self._equations.solve(self._motion.x)
        R = answer.bodies.R[:-1]
        return answer, R, answer.bodies.w[:-1], np.einsum("nij,nj->ni", R, self._equations.com)

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        equations, x = self._equations, self._motion.x
        answer, R, w, arm = self._solved()
        bodies, count = answer.bodies, len(R)
        force, torque = equations.applied.of_joints(bodies, answer.ends)
        np.add.at(force, equations.connections.owner, answer.multipliers[:, None] * answer.rows.force)
        np.add.at(torque, equations.connections.owner, answer.multipliers[:, None] * answer.rows.torque)
        q = equations.parts(x)[1]
        return MechanismSample(
            p_WB=bodies.r[:count] - arm,
            v_WB=bodies.v[:count] - cross(w, arm),
            w_WB=w.copy(),
            q_WB=q / np.linalg.norm(q, axis=1, keepdims=True),
            joint_force=force,
            joint_torque=torque,
        )

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`; gravity from the forces on the bodies at rest."""
        equations = self._equations
        answer, R, w, arm = self._solved()
        bodies, count = answer.bodies, len(R)
        of_com = answer.acceleration.reshape(count, 6)
        turning = np.einsum("nij,nj->ni", R, of_com[:, 3:])
        joints = len(self._mechanism.joints)
        ends, rank = answer.ends, independent(answer.rows.C)
        axes = np.full((joints, 3), np.nan)
        for number, joint in enumerate(self._mechanism.joints):
            if joint.kind in WITH_AXIS:
                axes[number] = ends.A[number, :, 2]
        return MechanismBuilt(
            mass=equations.mass.copy(),
            com=equations.com.copy(),
            inertia=equations.inertia.copy(),
            joint_position=(bodies.r[equations.connections.b] + ends.arm_b)[:joints],
            joint_axis=axes,
            gravity=equations.applied.gravity,
            rows=len(answer.rows.C),
            rank=rank,
            mobility=6 * count - rank,
            acceleration=of_com[:, :3] - cross(turning, arm) - cross(w, cross(w, arm)),
            angular_acceleration=turning,
        )
