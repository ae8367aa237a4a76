"""Formulations ``null_space`` and ``constraint_dynamics``: motion of a mechanism, and its samples."""

from typing import Any

import numpy as np
import pinocchio as pin

from proofroll.core.errors import Diverged
from proofroll.core.integrators import INTEGRATORS
from proofroll.core.stalling import Stalled
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.dynamics.held_signals import drive
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample, of_drives, row_rank, unsaid
from proofroll.elements.mechanism.run.sentences import pose
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.engines.pinocchio.smooth.constraint_dynamics import ConstraintDynamics
from proofroll.engines.pinocchio.smooth.joint_tree import AXIS_COLUMN, JointTree, require_tangent_map
from proofroll.engines.pinocchio.smooth.null_space import LoopRows, NullSpace


class MechanismMotion:
    """Time integration of a mechanism from sample to sample."""

    def __init__(self, mechanism: Mechanism, settings: PinocchioSettings) -> None:
        self._mechanism = mechanism
        self.tree = JointTree(mechanism)
        self._model, self._data = self.tree.model, self.tree.model.createData()
        self._nq, self._end = self._model.nq, self._model.nq + self._model.nv
        rows = LoopRows(self.tree)
        mu = settings.proximal  # only constraint_dynamics has it
        self.dynamics = NullSpace(self.tree, rows) if mu is None else ConstraintDynamics(self.tree, mu)
        self.rows, self.rank = rows, rows.rank
        self._turns = self._nq != self._model.nv  # configurations hold quaternions
        if self._turns:
            require_tangent_map()
        self._eliminates = settings.projection and bool(rows.rank)
        # if signals change in time, it is the last component of the state, as integrators pass on nothing else
        start = np.concatenate([self.tree.q0, self.tree.v0, np.zeros(int(self.tree.varies))])
        resolution = float(getattr(settings, settings.resolution))
        self.motion = INTEGRATORS[settings.integrator](resolution)
        self.motion.begin(0.0, start, self._rates, self._accepted, np.ones(len(start)))

    def _rates(self, y: Array) -> Array:
        q, v = y[: self._nq], y[self._nq : self._end]
        if self.tree.varies:
            self.tree.now = y.item(-1)
            return np.append(self._rates_now(q, v), 1.0)
        return self._rates_now(q, v)

    def _rates_now(self, q: Array, v: Array) -> Array:
        if not self._turns:
            return np.concatenate([v, self.dynamics.acceleration(self._data, q, v)])
        q = pin.normalize(self._model, q)  # the rates must not depend on a quaternion's length, which drifts
        rate = pin.tangentMap(self._model, q).dot(v)
        return np.concatenate([rate, self.dynamics.acceleration(self._data, q, v)])

    def _accepted(self, t: float, y: Array) -> Array:
        if not np.isfinite(y.sum()):
            raise Diverged(f"the state is not finite at t = {t:.6g} s")
        if not self._turns and not self._eliminates:
            return y
        q, v = y[: self._nq], y[self._nq : self._end]
        if self._turns:
            q = pin.normalize(self._model, q)
        if self._eliminates:
            self.tree.now = t
            q, v = self.rows.eliminated(self._data, q, v)
        return np.concatenate([q, v, y[self._end :]])

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        start = self.motion.t
        try:
            self.motion.advance(t)
        except np.linalg.LinAlgError as error:
            raise Diverged(f"the equations became singular between {start:g} s and {t:g} s ({error})") from None
        except Stalled as error:
            raise Diverged(f"{error}{self._where()}") from None

    def _where(self) -> str:
        """Clause for messages on the present pose."""
        return ""


class MechanismRun(MechanismMotion):
    """Run of a mechanism; see :class:`proofroll.core.engine.Engine` for the methods."""

    def _where(self) -> str:
        return f"; {pose(self._mechanism, self.sample())}"

    def drive(self, values: Array) -> None:
        """See :class:`proofroll.core.engine_abilities.TakesTargets`."""
        drive(self._mechanism, values)
        self._renew()

    def _renew(self) -> None:
        """Lets the integrator begin again, as it may keep rates of the values before."""
        self.motion.restart()

    def _evaluated(self) -> tuple[Any, Array, Array, Array, Any, Array]:
        """Data of the present state, q, v, accelerations, forces on Pinocchio's joints, and on loops."""
        data = self._model.createData()
        q, v = self.motion.x[: self._nq], self.motion.x[self._nq : self._end]
        self.tree.now = self.motion.t
        acceleration, forces, on_loops = self.dynamics.reactions(data, q, v)
        pin.forwardKinematics(self._model, data, q, v, acceleration)
        pin.updateFramePlacements(self._model, data)
        return data, q, v, acceleration, forces, on_loops

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        data, q, v, acceleration, forces, on_loops = self._evaluated()
        velocities = [self.tree.velocity(data, frame) for frame in self.tree.body]
        force, torque = unsaid(self._mechanism)
        count = len(self._mechanism.joints)
        force[count:], torque[count:] = on_loops
        pin.rnea(self._model, data, q, v, acceleration, forces)
        for number, (joint, index) in enumerate(zip(self._mechanism.joints, self.tree.joint, strict=True)):
            if joint.kind != JointKind.FIXED:  # Pinocchio joins bodies held by a fixed joint into one
                R = data.oMi[index].rotation
                force[number], torque[number] = R @ data.f[index].linear, R @ data.f[index].angular
        return MechanismSample(
            p_WB=np.array([data.oMf[frame].translation for frame in self.tree.body]),
            v_WB=np.array([velocity.linear for velocity in velocities]),
            w_WB=np.array([velocity.angular for velocity in velocities]),
            q_WB=np.array([np.roll(pin.Quaternion(data.oMf[frame].rotation).coeffs(), 1) for frame in self.tree.body]),
            joint_force=force,
            joint_torque=torque,
            effort=self.tree.efforts(q, v) if self._mechanism.actuators else None,
            coupling=self.dynamics.on_couplings if self._mechanism.couplings else None,
            drive=of_drives(self._mechanism, self.dynamics.on_motions),
        )

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        model = self._model
        data, q, v, *_ = self._evaluated()
        inertias = [model.frames[frame].inertia for frame in self.tree.body]
        rows = self.dynamics.constraint_rows(model.createData(), q, v)
        rank = row_rank(rows)
        accelerations = [
            pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL_WORLD_ALIGNED) for frame in self.tree.body
        ]
        return MechanismBuilt(
            mass=np.array([inertia.mass for inertia in inertias]),
            com=np.array([inertia.lever for inertia in inertias]),
            inertia=np.array([inertia.inertia for inertia in inertias]),
            joint_position=np.array([data.oMf[frame].translation for frame in self.tree.at_joint]),
            joint_axis=self._axes(q),
            gravity=model.gravity.linear.copy(),
            rows=len(rows),
            rank=rank,
            mobility=model.nv - rank,
            acceleration=np.array([acceleration.linear for acceleration in accelerations]),
            angular_acceleration=np.array([acceleration.angular for acceleration in accelerations]),
            mass_matrix_error=self._mass_matrix_error(q),
            **self._matrices(q, v),
        )

    def _axes(self, q: Array) -> Array:
        """World directions of the joints' own axes of rotation or translation, (joints, 3)."""
        data = self._model.createData()
        pin.computeJointJacobians(self._model, data, q)
        axes = np.full((len(self._mechanism.joints), 3), np.nan)
        for number, (joint, index) in enumerate(zip(self._mechanism.joints, self.tree.joint, strict=True)):
            if joint.kind in AXIS_COLUMN:
                J = pin.getJointJacobian(self._model, data, index, pin.LOCAL_WORLD_ALIGNED)
                J = J.reshape(6, self._model.nv)  # a single column is returned as a vector
                column = J[:, self._model.joints[index].idx_v + AXIS_COLUMN[joint.kind]]
                axes[number] = column[:3] if joint.kind == JointKind.PRISMATIC else column[3:]
        return axes

    def _matrices(self, q: Array, v: Array) -> dict[str, Any]:
        """Mass matrix, and forces of velocities and of gravity; empty where velocities are not those of the tree."""
        if not self.tree.own_velocities:
            return {}
        model, data = self._model, self._model.createData()
        M = np.reshape(pin.crba(model, data, q), (model.nv, model.nv))
        weights = np.array(pin.computeGeneralizedGravity(model, data, q))
        both = np.array(pin.nonLinearEffects(model, data, q, v))
        upper = np.triu(M)
        return {"mass_matrix": upper + np.triu(M, 1).T, "velocity_forces": both - weights, "gravity_forces": weights}

    def _mass_matrix_error(self, q: Array) -> float:
        """Relative difference of the mass matrix of crba, used in the equations, from unit accelerations of rnea."""
        model, data, rest = self._model, self._model.createData(), np.zeros(self._model.nv)
        M = np.reshape(pin.crba(model, data, q), (model.nv, model.nv))
        M = np.triu(M) + np.triu(M, 1).T
        weight = pin.rnea(model, data, q, rest, rest).copy()
        needed = np.array([pin.rnea(model, data, q, rest, unit) - weight for unit in np.eye(model.nv)])
        return float(np.abs(M - needed).max() / np.abs(M).max())
